"""Arguments of the whole chain on one car."""
import argparse
import pathlib

from vcharge_evaluation.tools import ROOT


def argument_parser(description):
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--work", type=pathlib.Path, default=ROOT / "demo", help="folder for everything")
    parser.add_argument("--quick", action="store_true", help="simulated images of half the size, shorter drives")
    parser.add_argument("--scene", default="lot", help="simulated scene: lot or garage")
    parser.add_argument("--seed", type=int, default=1, help="seed of the scene and of noise")
    parser.add_argument("--rig-seed", type=int, default=1, help="seed of the lenses and of how they are mounted")
    parser.add_argument("--no-nodelets", action="store_true", help="offline tools only")
    parser.add_argument("--no-rviz", action="store_true", help="no pictures of rviz")
    own = parser.add_argument_group("your own recordings")
    own.add_argument("--bag", type=pathlib.Path, help="drive with images and /odom: calibrates, and is mapped")
    own.add_argument("--other-bag", type=pathlib.Path, help="drive to localize in the map of --bag (default: --bag itself)")
    own.add_argument("--boards", type=pathlib.Path,
                     help="pictures of the board: a folder of images, or a bag, per camera: BOARDS/CAMERA or BOARDS/CAMERA.bag")
    own.add_argument("--board", default="9x6", help="inner corners of the chessboard")
    own.add_argument("--square-m", type=float, default=0.1, help="side of its squares")
    own.add_argument("--rig", type=pathlib.Path,
                     help="rig.yaml: with intrinsics alone, with masks beside --boards, or with extrinsics, which "
                          "are then used as they are")
    return parser


def arguments(description):
    parser = argument_parser(description)
    args = parser.parse_args()
    if args.bag is None and (args.boards or args.rig or args.other_bag):
        parser.error("--boards, --rig and --other-bag go with --bag")
    if args.bag is not None and not (args.boards or args.rig):
        parser.error("--bag needs --boards (pictures of the board) or --rig (a rig.yaml with intrinsics)")
    for path in (args.bag, args.other_bag, args.boards, args.rig):
        if path is not None and not path.exists():
            parser.error(f"{path}: there is no such file or folder")
    return args
