"""Parser of TOML text that refuses integers of more than 64 bits."""

import tomllib
from typing import Any

from chaincor.lammps_inputs.errors import SceneError

# TOML's integers have 64 bits.
_MOST_BITS = 64


def parse_toml(text: str, source: str) -> dict[str, Any]:
    """
    Parse TOML text.

    Raises SceneError, which names the source, if the text is not TOML or has an integer of more
    than 64 bits.
    """
    try:
        fields = tomllib.loads(text.removeprefix("\ufeff"))
    except RecursionError:
        raise SceneError(f"{source} is not valid TOML: it is nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"{source} is not valid TOML: {error}") from None
    except ValueError:  # Python does not convert integers of thousands of digits
        raise SceneError(
            f"{source} holds an integer of thousands of digits. Give an integer of at most "
            f"{_MOST_BITS} bits, the range of TOML"
        ) from None
    _refuse_long_integers(fields, source)
    return fields


def _refuse_long_integers(fields: dict[str, Any], source: str) -> None:
    inside: list[tuple[str, Any]] = [*fields.items()]
    while inside:
        key, value = inside.pop()
        if isinstance(value, dict):
            inside += value.items()
        elif isinstance(value, list):
            inside += ((key, each) for each in value)
        elif isinstance(value, int) and value.bit_length() > _MOST_BITS:
            raise SceneError(
                f"{source}: {key[:40]} is an integer of {value.bit_length()} bits. Give at most "
                f"{_MOST_BITS} bits, the range of TOML"
            )
