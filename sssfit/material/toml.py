"""The text form of a material: TOML to tables of known keys, and back to TOML.

Only the structure is checked here: tables, keys, and the likely meaning of a wrong key. The records
in ``sssfit.material`` check the values, so a material made in Python meets the same rules. Messages
name the key; the caller adds the file in front.
"""

import contextlib
import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

from sssfit.errors import MaterialError
from sssfit.files import reason
from sssfit.messages import did_you_mean, printable, shown
from sssfit.text import Text, decode

REQUIRED_KEYS = ("eta", "g", "sigma_a_per_mm", "sigma_s_per_mm")
LAYER_KEYS = (*REQUIRED_KEYS, "thickness_mm")
HEAD_KEYS = ("name", "source", "channels", "eta_above", "eta_below", "dense")
MOST_BYTES = 1_000_000

_COEFFICIENT = r"(?:sigma|mu)_?(a|s)(_?p(?:rime)?|_reduced)?(?:_(?:per_)?(um|mm|cm|m))?"
_THICKNESS = r"(?:thickness|depth)(?:_(um|mm|cm|m))?"
_TO_PER_MM = {
    "um": " and multiply its values by 1000",
    "cm": " and divide its values by 10",
    "m": " and divide its values by 1000",
    "mm": "",
    None: " and, if they are 1/cm, divide its values by 10",
}
_TO_MM = {
    "um": " and divide it by 1000",
    "cm": " and multiply it by 10",
    "m": " and multiply it by 1000",
    "mm": "",
    None: ", a length in mm",
}
_FROM_ALBEDO = "give sigma_a_per_mm = (1 - albedo) sigma_t and sigma_s_per_mm = albedo sigma_t"
_ALIASES = {
    "ior": "call it eta",
    "n": "call it eta",
    "refractive_index": "call it eta",
    "anisotropy": "call it g",
    "albedo": _FROM_ALBEDO,
    "sigma_t": _FROM_ALBEDO,
    "sigma_t_per_mm": _FROM_ALBEDO,
}
_EXAMPLE = '`load_material("skin1").to_toml()` gives an example'
# Files of other kinds by their ending.
_OTHER_KINDS = {
    ".mci": "an input file of MCML: run `simulate` on it, and take the profile that this writes",
    ".mco": "output of MCML: import it, and take the profile that this writes",
    ".csv": "a table: import it, and take the profile that this writes",
    ".json": "a kernel or another JSON file",
}
_MISSING = {
    "g": "add g = 0.0 if scattering is isotropic or sigma_s is a reduced one (sigma_s')",
}


def is_path(wanted: str) -> bool:
    """Return whether a text is meant as a path rather than a shipped name."""
    if wanted.endswith(".toml") or "/" in wanted or "\\" in wanted:
        return True
    with contextlib.suppress(OSError, ValueError):  # a name too long, or with a null character
        return wanted != "" and Path(wanted).exists()
    return False


def check_kind(path: Path, content: str) -> None:
    """Say what a file is that is no TOML and has the ending of another kind, and what to do."""
    what = _OTHER_KINDS.get(path.suffix.lower())
    if what is None:
        return
    try:
        tomllib.loads(content)
    except (ValueError, RecursionError):
        raise MaterialError(
            f"{printable(str(path))} is {what}; expected a material (.toml, or a shipped name)."
        ) from None


def read_text(source: Path | BinaryIO) -> Text:
    """Read a material file, at most ``MOST_BYTES`` of it."""
    if not isinstance(source, Path):
        return _decoded(source.read(MOST_BYTES + 1))
    try:
        is_folder = source.is_dir()
        content = b"" if is_folder else _first_bytes(source)
    except OSError as error:
        raise MaterialError(f"the file cannot be read: {reason(error)}.") from None
    except ValueError as error:  # a null character in the path
        raise MaterialError(f"the file cannot be read: {error}.") from None
    if is_folder:
        raise MaterialError("this is a folder; name a material file in it.")
    return _decoded(content)


def _first_bytes(path: Path) -> bytes:
    with path.open("rb") as stream:
        return stream.read(MOST_BYTES + 1)


def _decoded(content: bytes) -> Text:
    """Return the text of a material file, in UTF-8 or an encoding of Windows."""
    if len(content) > MOST_BYTES:
        raise MaterialError("the file is larger than 1 MB; expected a TOML file of a few lines.")
    text = decode(content)
    if text is None:
        raise MaterialError("the file is not text; expected a material file in TOML.")
    return text


def default_channels(n_values: int) -> tuple[str, str, str]:
    """Return R, G, B for three values; other numbers of values need names."""
    if n_values != 3:
        raise MaterialError(
            f"channels is missing; it may be left out for three values (R, G, B), and there are "
            f'{n_values}; name them, such as channels = ["550nm", "600nm"].'
        )
    return ("R", "G", "B")


def read_tables(text: str) -> tuple[dict[str, Any], list[tuple[str, dict[str, Any]]]]:
    """Read a material's TOML into its head and its layers; checks keys but not values.

    Returns
    -------
    head : dict
        Values of the ``HEAD_KEYS`` that are present.
    layers : list of (str, dict)
        From the top down, each with the prefix of its keys in messages: ``layers[0].``, or an empty
        text if the coefficients are at the top level.

    Raises
    ------
    MaterialError
        The text is not TOML, or a key is unknown, missing or in the wrong table.
    """
    document = _read_toml(text)
    _check_keys(document, (*HEAD_KEYS, *LAYER_KEYS, "layers"), "")
    head = {key: document[key] for key in HEAD_KEYS if key in document}
    if not isinstance(head.get("dense", False), bool):
        raise MaterialError(f"dense = {shown(head['dense'])}; expected true or false.")
    flat = {key: document[key] for key in LAYER_KEYS if key in document}
    if "layers" not in document:
        layers = [("", flat)]
    elif flat:
        raise MaterialError(
            f"{next(iter(flat))} and [[layers]] are both given; put every layer's values under its "
            "own [[layers]], or leave [[layers]] out."
        )
    else:
        layers = _layer_tables(document["layers"])
    for where, layer in layers:
        _check_complete(layer, where)
    return head, layers


def write_toml(head: Mapping[str, Any], layers: Sequence[Mapping[str, Any]]) -> str:
    """Write the text that ``read_tables`` reads: one layer at the top level, more as [[layers]]."""
    lines = _assignments(head)
    if len(layers) == 1:
        lines += _assignments(layers[0])
        if "thickness_mm" not in layers[0]:
            lines.append("# thickness_mm = 5.0    # left out: semi-infinite")
    else:
        for layer in layers:
            lines += ["", "[[layers]]", *_assignments(layer)]
    return "\n".join(lines) + "\n"


def _read_toml(text: str) -> dict[str, Any]:
    """Parse TOML; every error becomes one line."""
    if not text.strip():
        raise MaterialError(f"the file is empty; {_EXAMPLE}.")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise MaterialError("tables or lists nest too deep; a material has two levels.") from None
    except ValueError as error:  # TOMLDecodeError, and integers of more than 4300 digits
        raise MaterialError(f"not valid TOML: {printable(str(error))}.") from None


def _layer_tables(layers: object) -> list[tuple[str, dict[str, Any]]]:
    """Check that ``layers`` is an array of tables with known keys."""
    if not isinstance(layers, list) or not layers:
        raise MaterialError(
            f"layers = {shown(layers)}; expected one [[layers]] table (two brackets) per layer."
        )
    located = [(f"layers[{k}].", layer) for k, layer in enumerate(layers)]
    for where, layer in located:
        if not isinstance(layer, dict):
            raise MaterialError(
                f"{where[:-1]} = {shown(layer)} is not a table; write it under [[layers]]."
            )
        _check_keys(layer, LAYER_KEYS, where)
    return located


def _check_keys(table: Mapping[str, object], known: Sequence[str], where: str) -> None:
    """Raise an error for an unknown key, with the likeliest remedy."""
    for key in table:
        if key not in known:
            name = key if re.fullmatch(r"[\w'-]{1,60}", key, re.ASCII) else shown(key)
            raise MaterialError(
                f"{where}{name} = {shown(table[key])}: {name} is not a key of a material"
                f"{' layer' if where else ''}; {_remedy(key, known)}."
            )


def _remedy(key: str, known: Sequence[str]) -> str:
    """Return what to write in place of an unknown key."""
    if key == "name":
        return (
            "leave it out, since layers have no names; a material's is above the first [[layers]]"
        )
    if key in HEAD_KEYS:
        return "it belongs at the top level, above the first [[layers]]"
    if match := re.fullmatch(_COEFFICIENT, key, re.IGNORECASE):
        letter, prime, unit = match[1].lower(), match[2], match[3]
        with_g = " with g = 0" if prime else ""
        verb = "give it as" if prime else "rename it"
        return f"{verb} sigma_{letter}_per_mm{with_g}{_TO_PER_MM[unit and unit.lower()]}"
    if match := re.fullmatch(_THICKNESS, key, re.IGNORECASE):
        return f"rename it thickness_mm{_TO_MM[match[1] and match[1].lower()]}"
    return _ALIASES.get(key.lower()) or f"{did_you_mean(key, known)}known keys: {', '.join(known)}"


def _check_complete(layer: Mapping[str, object], where: str) -> None:
    """Raise an error for a layer that lacks a coefficient."""
    for key in REQUIRED_KEYS:
        if key not in layer:
            raise MaterialError(f"{where}{key} is missing; {_MISSING.get(key, _EXAMPLE)}.")


def _assignments(table: Mapping[str, Any]) -> list[str]:
    return [f"{key} = {_literal(value)}" for key, value in table.items()]


def _literal(value: Any) -> str:
    """Write one value in TOML; ``repr`` of a float reads back to the same bits."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, str):
        # JSON's escapes are valid in TOML, but JSON leaves DEL unescaped and TOML does not.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return "[" + ", ".join(_literal(each) for each in value) + "]"
