"""Every line of an export that a porter changes has a comment that says what it is."""

import re
import subprocess

import pytest
from shader_runs import PRECISION, needs
from test_export import small_kernel
from test_shaders import FOLLOWED, MOVED, RUN, TABLES, of_two_materials

from sssfit.export import kernel_text

# Written apart from the library: calls, types and arrays as the languages' manuals have them.
CALLS = {
    "hlsl": r"\.(Sample\w*|Load|Gather\w*)\(|GroupMemoryBarrier\w*\(",
    "glsl": r"\btexture\w*\(|\btexelFetch\w*\(|\bbarrier\(|\bimage\w+\(",
    "wgsl": r"\btexture[A-Z]\w*\(|\bworkgroupBarrier\(",
}
TYPES = {
    "hlsl": r"\b(RW)?(Texture\w+|\w*Buffer)<|\bSampler\w*State\b|\bgroupshared\b",
    "glsl": r"\b[iu]?(sampler|image|texture)\d\w*\b|\bshared\b|\bbuffer\b",
    "wgsl": r"\btexture_\w+|:\s*sampler\b|\bvar<\w+",
}
ARRAYS = {
    "hlsl": r"^\s*(static )?(const )?[\w<>]+ \w+\[\w+\]|\bstruct\b",
    "glsl": r"^\s*(const )?\w+ \w+\[\w+\]|\bstruct\b",
    "wgsl": r"\barray<",
}
OUTPUTS = {"hlsl": r"return float4\(", "glsl": r"return vec4\(", "wgsl": r"return vec4f\("}
COORDINATES = r"= position \* texel"

SWITCHES = ("coverage", "depth", "jitter", "tilt", "transmittance", "compute")
EVERY = [("plain", each, taps) for each, taps in TABLES]
EVERY += [("depth", *each) for each in FOLLOWED] + [("jitter", *each) for each in MOVED]
EVERY += [(each, "1-1|1-2", TABLES[2][1]) for each in SWITCHES]
EVERY += [(each, "star", dict(TABLES)["*|1-*|*"]) for each in SWITCHES]


def bare_lines(text, dialect):
    """Lines of code that another language or engine would have otherwise, without a comment."""
    patterns = (CALLS[dialect], TYPES[dialect], ARRAYS[dialect], OUTPUTS[dialect], COORDINATES)
    for line in text.splitlines():
        code, _, comment = line.partition("//")
        if any(re.search(each, code) for each in patterns) and len(comment.split()) < 2:
            yield line


@pytest.mark.parametrize("dialect", RUN)
@pytest.mark.parametrize(("switch", "name", "taps"), EVERY)
def test_lines_that_a_porter_changes_have_a_comment(switch, name, taps, dialect):
    more = {} if switch == "plain" else {switch: True}
    text, _ = kernel_text(taps, dialect, **more)
    assert list(bare_lines(text, dialect)) == [], name


@pytest.mark.parametrize("dialect", RUN)
def test_so_they_have_with_several_materials_and_in_dense_passes(dialect):
    for kernels, more in (
        (of_two_materials(), {"depth": True, "transmittance": True}),
        (of_two_materials(), {"compute": True}),
        (small_kernel(), {"with_shader": True}),
        (small_kernel(), {}),
    ):
        assert list(bare_lines(kernel_text(kernels, dialect, **more)[0], dialect)) == []


@pytest.mark.parametrize("dialect", RUN)
def test_a_line_without_its_comment_is_found(dialect):
    text, _ = kernel_text(TABLES[2][1], dialect)
    for line in text.splitlines():
        code, comment = line.partition(" // ")[::2]
        if comment and code and not code.startswith("#"):
            assert list(bare_lines(code, dialect)) == [code]
    bare = "\n".join(each.partition(" // ")[0] for each in text.splitlines())
    assert len(list(bare_lines(bare, dialect))) > 15


@pytest.mark.parametrize("dialect", RUN)
def test_comments_end_no_statement_and_hold_no_directive(dialect):
    """Babylon.js ends a line at every semicolon and looks for directives anywhere in it."""
    for _, _, taps in EVERY:
        for line in kernel_text(taps, dialect)[0].splitlines():
            code, _, comment = line.partition("//")
            assert not code or not re.search("[;#]", comment)


@pytest.mark.parametrize("compute", [False, True])
def test_glsl_compiles_from_the_version_on_that_it_names(compute, tmp_path):
    needs("hlsl")  # its compiler
    named_ones, older_ones = [], []
    chained = [each for each in EVERY if each[2].chained and each[1] not in ("lines", "turned")]
    for switch, _, taps in chained if compute else EVERY:
        if compute and switch not in ("plain", "transmittance"):
            continue
        more = {} if switch in ("plain", "compute") else {switch: True}
        text, _ = kernel_text(taps, "glsl", compute=compute, **more)
        named = re.search(r"^// Needs GLSL version (\d+) or (\d+ es) or later", text, re.MULTILINE)
        for version in named.groups():
            body = f"{PRECISION if version.endswith('es') else ''}{text}\nvoid main() {{ }}\n"
            named_ones.append(f"#version {version}\n{body}")
        older = {"130": "120", "430": "420"}[named[1]]
        older_ones.append(f"#version {older}\n{text}\nvoid main() {{ }}\n")
    assert refused(named_ones, tmp_path, compute) == []
    assert refused(older_ones, tmp_path, compute) == older_ones


def refused(texts, folder, compute):
    """Those of some shaders that do not compile; to start glslang for each would take .1 s."""
    group = "layout(local_size_x = 16, local_size_y = 16) in;\n" if compute else ""
    paths = [folder / f"{k}.{'comp' if compute else 'frag'}" for k in range(len(texts))]
    for path, text in zip(paths, texts, strict=True):
        first, rest = text.split("\n", 1)
        path.write_text(f"{first}\n{group}{rest}", encoding="utf-8")
    done = subprocess.run(["glslangValidator", *paths], capture_output=True, text=True, check=False)
    # It says the name of each, and after it what is wrong there.
    said = re.split(rf"^{re.escape(str(folder))}/\d+\.\w+$", done.stdout, flags=re.MULTILINE)[1:]
    found = [text for text, each in zip(texts, said, strict=True) if "ERROR: " in each]
    assert (done.returncode != 0) == bool(found)
    return found
