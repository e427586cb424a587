"""Mathematics as MathML, made when the pages are: readers need neither a network nor a script."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes

UNKNOWN = {r"\rm ": r"\mathrm ", r"\Bigl": r"\left", r"\Bigr": r"\right"}


def setup(app: Any) -> dict[str, Any]:
    """Offer Sphinx the renderer "mathml"."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def inline(translator: Any, node: nodes.math) -> None:
    """A formula in a line."""
    translator.body.append(mathml(node.astext(), display="inline"))
    raise nodes.SkipNode


def block(translator: Any, node: nodes.math_block) -> None:
    """A formula of its own, with its number where it has one."""
    number = "" if node.get("nowrap") or not node.get("number") else f"({node['number']})"
    tag = f'<span class="eqno">{number}</span>' if number else ""
    translator.body.append(
        translator.starttag(node, "div", CLASS="math")
        + tag
        + mathml(node.astext(), display="block")
        + "</div>\n"
    )
    raise nodes.SkipNode


def mathml(latex: str, display: str) -> str:
    """LaTeX as MathML; what is not understood stops the build."""
    from latex2mathml.converter import convert

    made = convert(latex.strip(), display=display)
    if re.search(r"<m(?:i|text)>\\", made):
        raise ValueError(f"no MathML for {latex!r}")
    return made
