"""A dense kernel as source of a language: constant arrays with a comment that explains them."""

from sssfit.export.constants import Writer
from sssfit.export.dialects import Dialect, mark
from sssfit.export.document import description
from sssfit.kernel import SeparableKernel


def dense(kernel: SeparableKernel, dialect: Dialect, prefix: str = "SSS") -> str:
    """Return constant arrays of the signs and weights of each term, one term after the other.

    One to four channels are one vector each; more channels follow one another.
    """
    write = Writer(dialect, prefix)
    terms, pixels, channels = kernel.weights.shape
    lines = [
        mark(dialect),
        *(f"// {line}" for line in description(kernel)),
        write.scalar("uint", "TERMS", [terms]),
        write.scalar("uint", "PIXELS", [pixels]),
        write.scalar("float", "MM_PER_PIXEL", [kernel.mm_per_pixel]),
        write.vector("SCALE", kernel.scale.tolist()),
        *write.rows("SIGN", kernel.signs.tolist()),
        *write.rows("WEIGHT", kernel.weights.reshape(-1, channels).tolist()),
    ]
    return "\n".join([*lines, ""])
