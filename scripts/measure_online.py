#!/usr/bin/python3
"""Measures the nodelets online: rate, latency, drops, processor time and memory, on the machine as it is, with AVX2 only, and on
one core. measure_online.py --bag DRIVE.bag --rig rig.yaml [--map LOT.vmap] [--json FILE]; --help lists all arguments."""
import os
import pathlib
import sys

SCRIPT = pathlib.Path(__file__).resolve().parent / "in_build.sh"
PATHS = ("--bag", "--rig", "--map", "--range-options", "--json", "--profile", "--work")  # the script changes the folder
WORDS = [os.path.abspath(word) if before in PATHS else word for before, word in zip(sys.argv, sys.argv[1:])]
os.execv(SCRIPT, [str(SCRIPT), "/usr/bin/python3", "-m", "vcharge_evaluation", "online", *WORDS])
