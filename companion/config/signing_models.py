"""What a mission may say about MAVLink 2 signing.  The key itself is never in it."""

from typing import Annotated

from pydantic import Field

from companion.config.base import Section


class SigningConfig(Section):
    """Packets are signed, and what comes without the right signature is not read."""

    key_file: Annotated[str, Field(min_length=1)] | None = Field(
        default=None,
        description="File of the key: 32 bytes, or 64 hexadecimal digits; readable by its owner "
        "alone. Without it the key is taken from COMPANION_SIGNING_KEY.",
        examples=["signing.key"],
    )
    link_id: Annotated[int, Field(ge=0, le=255)] = Field(
        default=0,
        description="Id of this link in our signatures; give another to each companion that "
        "reaches the vehicle as the same system over another link.",
    )
