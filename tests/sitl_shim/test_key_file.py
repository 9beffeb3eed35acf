"""Where the shim's signing key may come from."""

import pytest

from sitl_shim.key_file import KEY_VARIABLE, signing_key

KEY, OTHER = bytes(range(200, 232)), bytes(range(32))


def key_file(folder, content, mode=0o600):
    path = folder / "signing.key"
    path.write_bytes(content)
    path.chmod(mode)
    return path


@pytest.mark.parametrize("content", [KEY, KEY.hex().encode(), KEY.hex().encode() + b"\n"])
def test_a_file_of_its_owner_alone_gives_the_key(tmp_path, content):
    assert signing_key(key_file(tmp_path, content), {KEY_VARIABLE: OTHER.hex()}) == KEY


@pytest.mark.parametrize("mode", [0o644, 0o640, 0o604, 0o602, 0o620])
def test_a_file_of_others_is_refused_with_the_remedy(tmp_path, mode):
    path = key_file(tmp_path, KEY, mode)

    with pytest.raises(ValueError, match=rf"mode {mode:04o}.*chmod 600 "):
        signing_key(path, {})


@pytest.mark.parametrize("content", [b"", b"secret", KEY[1:], bytes(32), b"0" * 64, b"g" * 64])
def test_what_is_no_key_is_refused_and_not_shown(tmp_path, content):
    with pytest.raises(ValueError, match="holds no signing key") as caught:
        signing_key(key_file(tmp_path, content), {})
    assert "secret" not in str(caught.value)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(ValueError, match="can't be read: No such file"):
        signing_key(tmp_path / "none", {})


def test_the_environment_gives_the_key_where_no_file_does():
    assert signing_key(None, {KEY_VARIABLE: KEY.hex()}) == KEY
    assert signing_key(None, {}) is None
    for text in ("", "x" * 64, "0" * 64, KEY.hex()[1:]):
        with pytest.raises(ValueError, match=KEY_VARIABLE) as caught:
            signing_key(None, {KEY_VARIABLE: text})
        assert KEY.hex()[1:9] not in str(caught.value)
