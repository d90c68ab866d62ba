"""Figures of an evaluation: measured values with their goals, as tables and as JSON.

doc/results/STAGE.json holds {"title", "measurements"}; each measurement has a title, the condition under which it was
made, command, date, commit, and its figures: name, value, unit, goal and whether it was reached (null without a goal).
"""
import dataclasses
import datetime
import json
import math
import os
import pathlib
import subprocess
import sys

from vcharge_evaluation.tools import ROOT, say

RESULTS = ROOT / "doc" / "results"
PICTURES = RESULTS / "pictures"
MIN_CONDITIONS_OF_SUMMARY = 3
MAX_COLUMNS = 6  # with more conditions each has a row


@dataclasses.dataclass
class Figure:
    name: str
    value: object  # a number or text; None: not measured
    unit: str = ""
    goal: str = ""
    reached: object = None  # True, False, or None without a goal

    def badness(self):
        """How bad the value is, larger is worse, for values of one figure; None if it has no bound as the goal and is no
        error."""
        sign = {"<=": 1.0, ">=": -1.0}.get(self.goal.split(" ")[0])
        if sign is None and (self.goal == "0" or (not self.goal and "error" in self.name)):
            sign = 1.0
        if sign is None or isinstance(self.value, str):
            return None
        return math.inf if self.value is None else sign * self.value

    def text(self):
        """Value and unit for a table; bold where the goal is missed."""
        value = number_text(self.value) + (f" {self.unit}" if self.unit and self.value is not None else "")
        return f"**{value}**" if self.reached is False else value


def number_text(value):
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"
    return str(value)


def figure(name, value, unit="", at_most=None, at_least=None, equal=None):
    """A figure whose goal is a bound, a range, or a value. None as the value misses every goal."""
    goals, reached = [], True
    for sign, bound, fulfils in (("<=", at_most, lambda: value <= at_most), (">=", at_least, lambda: value >= at_least),
                                 ("", equal, lambda: value == equal)):
        if bound is not None:
            goals.append(f"{sign} {number_text(bound)}".strip())
            reached = reached and value is not None and bool(fulfils())
    if isinstance(value, float) and value != value:
        value = None
    return Figure(name, value, unit, " and ".join(goals), reached if goals else None)


@dataclasses.dataclass
class Measurement:
    title: str
    condition: str
    figures: list
    command: str = ""
    date: str = ""
    commit: str = ""


def row(cells):
    return "|" + "|".join(cells) + "|"


def table(measurements):
    """Markdown table of measurements with one title: a column per condition (a row where there are many), those that miss most
    goals first, and among these the one whose first bounded figure or error is worst. From three conditions on, the median (of
    an even number, the worse one in the middle) and the worst figure with its condition stand before them, and the 95 %
    quantile where there are many."""
    columns = {}
    for one in measurements:
        columns.setdefault(one.condition, {}).update({figure.name: figure for figure in one.figures})
    names = list(dict.fromkeys(figure.name for one in measurements for figure in one.figures))
    columns = dict(sorted(columns.items(), key=lambda item: rank(item[1])))
    has_goals = any(figure.goal for one in measurements for figure in one.figures)
    shares = {}
    if len(columns) >= MIN_CONDITIONS_OF_SUMMARY:
        shares = {"median": 0.5, **({"95 %": 0.95} if len(columns) > MAX_COLUMNS else {}), "worst": 1.0}
    heads = ["what", *(["goal"] if has_goals else []), *shares, *(condition or "figure" for condition in columns)]
    lines = [heads]
    for name in names:
        goals = [column[name].goal for column in columns.values() if name in column and column[name].goal]
        cells = [column[name].text() if name in column else "-" for column in columns.values()]
        summary = summarize({condition: column[name] for condition, column in columns.items() if name in column},
                            shares.values())
        lines.append([name, *([goals[0] if goals else ""] if has_goals else []), *summary, *cells])
    if len(columns) > MAX_COLUMNS:
        lines = list(zip(*lines))
    return "\n".join([row(lines[0]), "|" + "---|" * len(lines[0]), *(row(line) for line in lines[1:])])


def rank(column):
    """Sorts conditions, worst first."""
    badness = next((figure.badness() for figure in column.values() if figure.badness() is not None), -math.inf)
    return -num_missed(column), -badness


def num_missed(column):
    return sum(figure.reached is False for figure in column.values())


def summarize(figures, shares):
    """Cells with the figures below which these shares of the conditions are, the worst with its condition unless all
    are equal; figures: {condition: figure}."""
    ranked = sorted((one.badness(), condition) for condition, one in figures.items() if one.badness() is not None)
    if len(ranked) < 2:
        return [""] * len(shares)
    chosen = [ranked[min(int(share * len(ranked)), len(ranked) - 1)][1] for share in shares]
    differ = ranked[0][0] != ranked[-1][0]
    return [figures[condition].text() + (f" ({condition})" if share == 1.0 and differ else "")
            for share, condition in zip(shares, chosen)]


def by_title(measurements):
    """Lists of measurements with the same title, in order."""
    groups = {}
    for one in measurements:
        groups.setdefault(one.title, []).append(one)
    return groups


def read(path):
    """Title of the stage and its measurements."""
    stage = json.loads(path.read_text(encoding="utf-8"))
    return stage["title"], [Measurement(**{**one, "figures": [Figure(**entry) for entry in one["figures"]]})
                            for one in stage["measurements"]]


def write(path, title, measurements):
    text = json.dumps({"title": title, "measurements": [dataclasses.asdict(one) for one in measurements]}, indent=1,
                      ensure_ascii=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.tmp")
    temporary.write_text(text + "\n", encoding="utf-8")
    os.replace(temporary, path)


def merge(old, new):
    """`new` in place of older measurements with the same title and condition; the others stay."""
    replaced = {(one.title, one.condition): one for one in new}
    kept = [replaced.pop((one.title, one.condition), one) for one in old]
    return kept + list(replaced.values())


def drop_others(path, wanted):
    """Removes what other commits than `wanted` measured from a file of results."""
    title, measurements = read(path)
    write(path, title, [one for one in measurements if one.commit == wanted])


def commit():
    """The commit of the source tree, with -dirty where anything but results was changed since."""
    def git(*words):
        return subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True, check=False).stdout.strip()

    changed = git("status", "--porcelain", "--untracked-files=no", "--", ".", ":!doc/results", ":!doc/results.md")
    return git("rev-parse", "--short=7", "HEAD") + ("-dirty" if changed else "")


def words_that_matter(words):
    """Arguments without those that leave the figures as they are. Paths below the folder --work begin with WORK."""
    work = next((after for word, after in zip(words, words[1:]) if word == "--work"), None)
    kept = []
    for before, word in zip(["", *words], words):
        if before != "--work" and word not in ("--work", "--publish"):
            is_below = work is not None and pathlib.Path(work) in pathlib.Path(word).parents
            kept.append(str("WORK" / pathlib.Path(word).relative_to(work)) if is_below else
                        os.path.relpath(word, ROOT) if os.path.isabs(word) else word)
    return kept


class Results:
    """What a stage's evaluation measures: printed as it comes, and kept in WORK/STAGE.json. With `publish` it also goes
    into doc/results/STAGE.json."""

    def __init__(self, stage, title, args):
        self.stage, self.title = stage, title
        self.path, self.publish = args.work / f"{stage}.json", args.publish
        self.command = " ".join(["scripts/evaluate.sh", stage, *words_that_matter(sys.argv[1:])])

    def add(self, title, *columns):
        """Adds and prints a table; a column is (condition, figures)."""
        now = datetime.date.today().isoformat()
        new = [Measurement(title, condition, list(figures), self.command, now, commit()) for condition, figures in columns]
        print(f"\n### {title}\n\n{table(new)}", flush=True)
        for path in [self.path, *([RESULTS / f"{self.stage}.json"] if self.publish else [])]:
            write(path, self.title, merge(read(path)[1] if path.exists() else [], new))

    def show(self, picture, caption, badness):
        """Makes a picture (BGR) that of the stage, with its caption (scene and figure), if it is the worst (largest badness)
        of those drawn at this commit. With `publish` it also goes into doc/results/pictures."""
        from vcharge_evaluation.drawing.pictures import save_small  # the page is made without OpenCV and rosbag

        for folder in [self.path.parent / "pictures", *([PICTURES] if self.publish else [])]:
            entry = read_caption(folder / f"{self.stage}.json")
            if entry and entry["commit"] == commit() and entry["badness"] >= badness:
                continue
            folder.mkdir(parents=True, exist_ok=True)
            save_small(folder / f"{self.stage}.jpg", picture)
            entry = {"caption": caption, "badness": badness, "command": self.command, "commit": commit(),
                     "date": datetime.date.today().isoformat()}
            (folder / f"{self.stage}.json").write_text(json.dumps(entry, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")

    def end(self):
        say(f"written: {self.path}")


def add_arguments(parser, work):
    """What every evaluation takes."""
    parser.add_argument("--work", type=pathlib.Path, default=pathlib.Path("build") / work,
                        help="folder for drives and results; complete drives in it are used again")
    parser.add_argument("--publish", action="store_true",
                        help="put the figures into doc/results too (then run python3 -m vcharge_evaluation.page)")


def read_caption(path):
    """Caption, badness, command, date and commit of a stage's picture; None without one."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def spread(name, errors, bound, unit="", factor=1.0, **goals):
    """Median, 95 % and worst of errors as figures; an error that is missing or not finite counts as the bound, as a larger
    one does. `goals` (at_most or at_least) is for the median."""
    bounded = sorted(min(error, bound) if error is not None and error == error else bound for error in errors)
    if not bounded:
        return [figure(f"{name}, {which}", None, unit, **(goals if which == "median" else {}))
                for which in ("median", "95 %", "worst")]
    values = [quantile(bounded, share) * factor for share in (0.5, 0.95, 1.0)]
    return [figure(f"{name}, median", values[0], unit, **goals), Figure(f"{name}, 95 %", values[1], unit),
            Figure(f"{name}, worst", values[2], unit)]


def calibration_figures(calibration):
    """Expected calibration error of a confidence, and its bins."""
    figures = [figure("expected calibration error", calibration["expected_calibration_error"], at_most=0.1)]
    for one in calibration["bins"]:
        low = min(int(10 * one["mean_confidence"] + 1e-9), 9)
        figures.append(Figure(f"right, of those with confidence {low / 10:g} to {(low + 1) / 10:g} (their mean; number)",
                              f"{100 * one['fraction_right']:.1f} % ({100 * one['mean_confidence']:.1f} %; {one['count']})"))
    return figures


def quantile(ordered, share):
    """Quantile of a sorted list, interpolated between ranks."""
    at = share * (len(ordered) - 1)
    low = int(at)
    high = min(low + 1, len(ordered) - 1)
    return float(ordered[low] + (at - low) * (ordered[high] - ordered[low]))


def percent(part, whole):
    return 100.0 * part / max(1, whole)
