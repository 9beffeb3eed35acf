import pytest

from companion.link.link import LinkError
from companion.link.url import LinkUrl, parse_link_url


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("udpin://127.0.0.1:14540", LinkUrl("udpin", "127.0.0.1", 14540)),
        ("udpin://0.0.0.0:0", LinkUrl("udpin", "0.0.0.0", 0)),
        ("udpout://drone.local:14580", LinkUrl("udpout", "drone.local", 14580)),
        (" UDPIN://localhost:1/ ", LinkUrl("udpin", "localhost", 1)),
        ("udpin://[::1]:14540", LinkUrl("udpin", "::1", 14540)),
        ("tcpout://192.168.4.1:5760", LinkUrl("tcpout", "192.168.4.1", 5760)),
        ("tcpin://127.0.0.1:0", LinkUrl("tcpin", "127.0.0.1", 0)),
        ("serial:///dev/ttyACM0:921600", LinkUrl("serial", "/dev/ttyACM0", 921600)),
        (
            "serial:///dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0:57600",
            LinkUrl("serial", "/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0", 57600),
        ),
    ],
)
def test_addresses_are_read_and_written_alike(text, expected):
    url = parse_link_url(text)

    assert url == expected
    assert parse_link_url(str(url)) == url


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("", "no scheme"),
        ("127.0.0.1:14540", "scheme"),
        ("udp://127.0.0.1:14540", "'udp'"),
        ("udpin://:14540", "no host"),
        ("udpin://127.0.0.1", "no port"),
        ("udpin://127.0.0.1:70000", "0..65535"),
        ("udpin://127.0.0.1:x", "0..65535"),
        ("udpin://127.0.0.1:-1", "0..65535"),
        ("udpout://127.0.0.1:0", "port 0"),
        ("udpin://127.0.0.1:1/extra", "more to it"),
        ("udpin://me@127.0.0.1:1", "more to it"),
        ("udpin://127.0.0.1:1?a=b", "more to it"),
        ("udpin://[::1:1", "IPv6"),
        ("tcp://127.0.0.1:5760", "'tcp'"),
        ("tcpout://127.0.0.1:0", "port 0"),
        ("serial:///dev/ttyACM0", "no baud rate"),
        ("serial:///dev/ttyACM0:", "no baud rate"),
        ("serial:///dev/ttyACM0:fast", "no baud rate"),
        ("serial://ttyACM0:57600", "three slashes"),
        ("serial:///dev/ttyACM0:300", "baud rate that is none"),
        ("serial:///dev/ttyACM0:99999999", "baud rate that is none"),
    ],
)
def test_what_is_no_address_is_explained_with_a_remedy(text, named):
    with pytest.raises(LinkError) as caught:
        parse_link_url(text)

    message = str(caught.value)
    assert named in message
    assert repr(text) in message
    assert "udpin://HOST:PORT" in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("text", "local"),
    [
        ("udpin://127.0.0.1:1", True),
        ("tcpin://[::1]:1", True),
        ("udpout://localhost:1", True),
        ("serial:///dev/ttyX:57600", True),
        ("udpin://0.0.0.0:1", False),
        ("udpout://192.168.1.2:14550", False),
        ("tcpin://drone.local:1", False),
    ],
)
def test_it_is_known_who_can_be_at_the_other_end(text, local):
    assert parse_link_url(text).is_local is local
