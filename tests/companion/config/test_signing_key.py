"""The signing key: where it may come from, and what is refused with the remedy."""

import os

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.config.signing_key import KEY_VARIABLE, signing_key
from companion.config.yaml_source import ConfigError

KEY = bytes(range(200, 232))
OTHER = bytes(range(32))


def key_file(folder, content, mode=0o600):
    path = folder / "signing.key"
    path.write_bytes(content)
    path.chmod(mode)
    return path


def refusal(*arguments, **options):
    with pytest.raises(ConfigError) as caught:
        signing_key(*arguments, **options)
    return str(caught.value)


@pytest.mark.parametrize(
    "content",
    [
        KEY,
        KEY.hex().encode(),
        KEY.hex().upper().encode() + b"\n",
        b"  " + KEY.hex().encode() + b"\r\n",
    ],
)
@pytest.mark.parametrize("mode", [0o600, 0o400, 0o700])
def test_a_key_is_read_from_a_file_of_its_owner_alone(tmp_path, content, mode):
    assert signing_key(key_file(tmp_path, content, mode), {}) == KEY


@pytest.mark.parametrize("mode", [0o644, 0o640, 0o604, 0o660, 0o602, 0o620, 0o610])
def test_a_file_that_others_can_read_or_change_is_refused_with_the_remedy(tmp_path, mode):
    path = key_file(tmp_path, KEY, mode)

    text = refusal(path, {})

    assert f"mode {mode:04o}" in text
    assert text.endswith(f"Run: chmod 600 {path}")


@pytest.mark.parametrize(
    "content",
    [b"", b"secret", KEY + b"!", KEY[:31], KEY.hex()[:-1].encode(), b"g" * 64, bytes(32), b"0" * 64,
     b"00 " * 22, bytes(5000)],
)  # fmt: skip
def test_what_is_no_key_is_refused_and_never_shown(tmp_path, content):
    text = refusal(key_file(tmp_path, content), {})

    assert "holds no signing key" in text
    assert "openssl rand -hex 32" in text
    assert "secret" not in text


def test_a_missing_file_is_refused(tmp_path):
    path = tmp_path / "none.key"

    assert f"{path}: the signing key can't be read: No such file" in refusal(path, {})
    assert "can't be read" in refusal(tmp_path, {})


def test_the_environment_gives_the_key_where_no_file_does(tmp_path):
    environment = {KEY_VARIABLE: KEY.hex() + "\n"}

    assert signing_key(None, environment) == KEY
    assert signing_key(key_file(tmp_path, OTHER), environment) == OTHER


@pytest.mark.parametrize("text", ["", "abc", "x" * 64, "0" * 64, KEY.hex() + "00"])
def test_a_bad_key_in_the_environment_is_refused_and_never_shown(text):
    told = refusal(None, {KEY_VARIABLE: text})

    assert told.startswith(f"{KEY_VARIABLE}: a key is 64 hexadecimal digits")
    assert KEY.hex()[:8] not in told


def test_without_a_key_nothing_is_signed_unless_it_was_asked_for():
    assert signing_key(None, {}) is None
    assert "there is no key" in refusal(None, {}, wanted=True)


@settings(deadline=None, derandomize=True, max_examples=100)
@given(text=st.text(max_size=70))
def test_no_text_of_the_environment_gives_anything_but_a_key_or_a_refusal(text):
    try:
        key = signing_key(None, {KEY_VARIABLE: text})
    except ConfigError:
        return
    assert key is not None
    assert key.hex() == text.strip().lower()


@pytest.mark.skipif(os.getuid() == 0, reason="root can read everything")
def test_an_unreadable_file_is_refused(tmp_path):
    assert "Permission denied" in refusal(key_file(tmp_path, KEY, 0o000), {})
