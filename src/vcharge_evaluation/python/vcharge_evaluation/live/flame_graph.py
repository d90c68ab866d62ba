"""Samples the call stacks of a process with perf, and draws them as a flame graph (Brendan Gregg, 2011): the width of a
function is its part of the processor time, and what it calls lies on top of it."""
import collections
import html
import re
import shutil
import signal
import subprocess

RATE_HZ, STACK_BYTES = 199, 24576
WIDTH_PX, ROW_PX, MARGIN_PX, CHARACTER_PX = 1200, 16, 10, 6.3
MIN_PART = 0.002  # of the whole: narrower functions are left out
COLOURS = (("vcharge", "#f4a259"), ("cv::", "#8cb369"), ("libopencv", "#8cb369"), ("tbb", "#c9ada7"), ("kernel", "#9a8c98"))
OTHER_COLOUR = "#d9d9d9"
FRAME = re.compile(r"\s+[0-9a-f]+ (.*) \((\S*)\)$")
# Frames that say nothing: wrappers of functions, threads, and TBB between a loop and its body.
PLUMBING = re.compile(r"^(std::|tbb::|boost::|\[libtbb|\[libstdc|\[unknown|clone|start_thread|__libc|_start|main$"
                      r"|vcharge::FrameAssembler)")


class Recording:
    """perf while a process works, until stop()."""

    def __init__(self, pid, path):
        if shutil.which("perf") is None:
            raise SystemExit("measure_online.py: --profile needs perf (Debian: linux-perf)")
        self.path = path
        self.process = subprocess.Popen(["perf", "record", "-q", "-F", str(RATE_HZ), "--call-graph", f"dwarf,{STACK_BYTES}",
                                         "-p", str(pid), "-o", path], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def stop(self):
        self.process.send_signal(signal.SIGINT)
        self.process.wait()

    def stacks(self):
        """Numbers of samples by call stack, outermost function first."""
        found = subprocess.run(["perf", "script", "--no-inline", "-i", self.path], capture_output=True, text=True, check=True)
        return fold(found.stdout.splitlines())


def fold(lines):
    """Numbers of samples by call stack, from the lines of perf script. Functions are without arguments."""
    stacks, frames = collections.Counter(), []
    for line in [*lines, ""]:
        match = FRAME.match(line)
        if match:
            frames.append(name_of(*match.groups()))
        elif not line and frames:
            useful = [frame for frame in reversed(frames) if not PLUMBING.match(frame)]
            stacks[tuple(name for i, name in enumerate(useful) if i == 0 or name != useful[i - 1])] += 1
            frames = []
    return stacks


def name_of(symbol, library):
    symbol = re.sub(r"\+0x[0-9a-f]+$", "", symbol)
    if symbol == "[unknown]":
        return "[" + library.rpartition("/")[2].strip("[]") + "]"
    symbol = symbol.replace("(anonymous namespace)", "{}").replace("vcharge::{}::", "vcharge::")
    return symbol.partition("(")[0] if "operator()" not in symbol else symbol


def by_stage(stacks, stages):
    """The stacks, each below its stage: the first whose words a function contains. They begin with that function."""
    found = collections.Counter()
    for stack, count in stacks.items():
        for stage, words in stages.items():
            begin = next((i for i, name in enumerate(stack) if any(word in name for word in words)), None)
            if begin is not None:
                found[(stage, *stack[begin:])] += count
                break
        else:
            found[("other", *stack)] += count
    return found


def shares(stacks):
    """Part of all samples by the outermost name of their stack, largest first."""
    counts = collections.Counter()
    for stack, count in stacks.items():
        counts[stack[0]] += count
    return {name: count / sum(counts.values()) for name, count in counts.most_common()}


def tree_of(stacks):
    root = ["all", 0, {}]
    for stack, count in stacks.items():
        node = root
        node[1] += count
        for name in stack:
            node = node[2].setdefault(name, [name, 0, {}])
            node[1] += count
    return root


def draw(stacks, title):
    """The flame graph as text of an SVG."""
    root = tree_of(stacks)
    total = root[1]
    boxes, deepest = [], 0

    def place(node, begin, depth):
        nonlocal deepest
        if node[1] < MIN_PART * total:
            return
        deepest = max(deepest, depth)
        boxes.append((node[0], begin, node[1], depth))
        for child in sorted(node[2].values(), key=lambda child: -child[1]):
            place(child, begin, depth + 1)
            begin += child[1]

    place(root, 0, 0)
    height = (deepest + 3) * ROW_PX + 2 * MARGIN_PX
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH_PX} {height}" font-family="monospace" font-size="11">',
             f'<rect width="{WIDTH_PX}" height="{height}" fill="white"/>',
             f'<text x="{MARGIN_PX}" y="{MARGIN_PX + 12}" font-size="13">{html.escape(title)}</text>']
    scale = (WIDTH_PX - 2 * MARGIN_PX) / max(1, total)
    for name, begin, count, depth in boxes:
        x, width = MARGIN_PX + begin * scale, count * scale
        y = height - MARGIN_PX - (depth + 1) * ROW_PX
        colour = next((colour for word, colour in COLOURS if word in name), OTHER_COLOUR)
        label = name.replace("vcharge::", "")[:max(0, int((width - 4) / CHARACTER_PX))]
        lines.append(f'<g><title>{html.escape(name)}: {100 * count / total:.1f} %</title>'
                     f'<rect x="{x:.1f}" y="{y}" width="{width:.1f}" height="{ROW_PX - 1}" fill="{colour}"/>'
                     + (f'<text x="{x + 2:.1f}" y="{y + 11}">{html.escape(label)}</text>' if len(label) > 2 else "") + "</g>")
    return "\n".join(lines + ["</svg>"]) + "\n"
