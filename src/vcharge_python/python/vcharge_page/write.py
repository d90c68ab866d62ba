"""Writes a page: the viewer, three.js and a scene in one HTML file."""
import html
import json
import os
import pathlib
import re

from vcharge import InputError
from vcharge_page.scene import Scene, text_of

VIEWER = pathlib.Path(__file__).parent / "viewer"
THREE = pathlib.Path("/usr/share/javascript/three/three.min.js")
# In the order of their dependencies. Modules cannot import each other in one file, so that they become functions.
MODULES = ("data", "view", "still", "points", "surface", "drive", "layers", "measure", "pictures", "panel", "main")
# Nothing is ever fetched, not even if a file names an address.
POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<title>{title}</title>
<style>
{style}
</style></head>
<body>
{body}
<script type="application/json" id="scene">{scene}</script>
{blocks}
<!--
{licence}
-->
<script>{three}</script>
<script type="module">
{viewer}
</script>
</body></html>
"""


def check_viewer():
    """InputError if three.js is missing."""
    if not THREE.is_file():
        raise InputError(f"{THREE}: no such file, install Debian's package libjs-three")


def viewer_text():
    """The modules of the viewer in one script, each in a function that returns what it exports."""
    parts = []
    for name in MODULES:
        text = (VIEWER / f"{name}.js").read_text(encoding="utf-8")
        exported = ", ".join(re.findall(r"^export (?:class|function|const) (\w+)", text, re.MULTILINE))
        text = re.sub(r'^import (\{[^}]*\}) from "\./(\w+)\.js";', r"const \1 = modules.\2;", text, flags=re.MULTILINE)
        text = re.sub(r"^export ", "", text, flags=re.MULTILINE)
        parts.append(f"modules.{name} = (() => {{\n{text}return {{{exported}}};\n}})();")
    return "const modules = {};\n" + "\n".join(parts)


def page_text(scene: Scene) -> str:
    """The HTML file."""
    check_viewer()
    blocks = "\n".join(f'<script type="text/plain" id="block-{name}">{text_of(block)}</script>'
                       for name, block in scene.blocks.items())
    # "<" would end the element early.
    description = json.dumps(scene.description, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return PAGE.format(policy=POLICY, title=html.escape(scene.description["title"]),
                       style=(VIEWER / "style.css").read_text(encoding="utf-8"),
                       body=(VIEWER / "body.html").read_text(encoding="utf-8"),
                       scene=description, blocks=blocks, licence=(VIEWER / "three_licence.txt").read_text(encoding="utf-8"),
                       three=THREE.read_text(encoding="utf-8").replace("</script", "<\\/script"), viewer=viewer_text())


def write_page(scene: Scene, path):
    """Writes a page; a file of this name is replaced once the new one is complete. Returns its size in bytes."""
    path = pathlib.Path(path)
    temporary = path.with_name(f".{path.name}.tmp")
    try:
        temporary.write_text(page_text(scene), encoding="utf-8")
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise InputError(f"{path}: cannot be written: {error.strerror}") from error
    return path.stat().st_size
