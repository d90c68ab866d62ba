"""Makes doc/results.md from doc/results/*.json: python3 -m vcharge_evaluation.page [--check]."""
import argparse
import sys

from vcharge_evaluation import results
from vcharge_evaluation.tools import ROOT

PAGE = ROOT / "doc" / "results.md"
# In the order of the pipeline; other stages follow by name.
ORDER = ("chain", "conditions", "masks", "calibration", "mapping", "localization", "living_map", "shutters", "ranges",
         "height_map", "bays", "surround_view", "obstacles", "standing", "steps", "objects", "faults", "odometry", "images", "online", "real_images", "foundations",
         "speed")
INTRODUCTION = """# Results

Made by `python3 -m vcharge_evaluation.page` from `doc/results/*.json`: do not edit. A figure that misses its goal is
**bold**. Each table names the command that measured it, the date and the commit. `scripts/evaluate.sh STAGE --publish`
measures again.

A result that is missing counts as an error at the bound that its row names. Where a row or title names `make_masks`, the masks
of the own body are those that this tool found in a drive, or none where it found none, and the truth only judges.
"""


def origin(one):
    return f"`{one.command}` ({one.date}, {one.commit})"


def show(measurements):
    """The table of measurements with one title, with its commands. Where each command measured something else, it is in its
    row."""
    origins = list(dict.fromkeys(origin(one) for one in measurements))
    names = [figure.name for one in measurements for figure in one.figures]
    if len(origins) == 1 or len(set(names)) < len(names):
        return f"{results.table(measurements)}\n\n" + "\n".join(f"- {one}" if len(origins) > 1 else one for one in origins)
    rows = [results.row([f"{one.condition + ': ' if one.condition else ''}{figure.name}", figure.text(), figure.goal, origin(one)])
            for one in measurements for figure in one.figures]
    return "\n".join(["|what|figure|goal|command|", "|---|---|---|---|", *rows])


def picture(folder, name):
    """Lines with the picture of a stage's worst case, if there is one."""
    entry = results.read_caption(folder / "pictures" / f"{name}.json")
    if entry is None:
        return []
    return [f"![worst case]({folder.name}/pictures/{name}.jpg)\n\nWorst case: {entry['caption']}. `{entry['command']}` "
            f"({entry['date']}, {entry['commit']})\n"]


def profile(folder, name):
    """Lines with a stage's flame graph, if there is one."""
    path = folder / "pictures" / f"{name}_profile.svg"
    return [f"![where the processor time goes]({folder.name}/pictures/{path.name})\n"] if path.exists() else []


def make_page(folder=results.RESULTS):
    parts = [INTRODUCTION]
    paths = {path.stem: path for path in folder.glob("*.json")}
    for name in sorted(paths, key=lambda name: (ORDER.index(name) if name in ORDER else len(ORDER), name)):
        title, measurements = results.read(paths[name])
        parts.append(f"## {title}\n")
        for heading, group in results.by_title(measurements).items():
            parts.append(f"### {heading}\n\n{show(group)}\n")
        parts += picture(folder, name) + profile(folder, name)
    return "\n".join(parts)


def main(words=None):
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; exit status 1 where the page is stale")
    args = parser.parse_args(words)
    page = make_page()
    if not args.check:
        PAGE.write_text(page, encoding="utf-8")
    elif not PAGE.exists() or PAGE.read_text(encoding="utf-8") != page:
        sys.exit(f"{PAGE}: stale; python3 -m vcharge_evaluation.page makes it")


if __name__ == "__main__":
    main()
