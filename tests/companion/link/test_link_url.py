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
