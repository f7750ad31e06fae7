"""gaident reproduce."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from gaident import paper
from gaident.checks import check_installed
from gaident.cli.output import print_json, write
from gaident.show.progress_bar import Progress

__all__ = ["reproduce_command"]


def reproduce_command(args: argparse.Namespace) -> None:
    check_installed(("matplotlib",), "pictures", "a picture of the paper")
    folder = Path(args.out)
    folder.mkdir(parents=True, exist_ok=True)
    with Progress(None if args.quiet else sys.stderr) as progress:
        result = paper.reproduce(args.trials, args.seeds, args.seed, args.workers, progress)
    pictures = paper.figures(result)
    for name, png in pictures.items():
        write(folder / f"{name}.png", png)
    target = folder / "paper.html"
    write(target, paper.page(result, pictures).encode())
    if args.json:
        print_json(result.to_dict())
        return
    print(paper.summary(result))
    print(f"\nwritten: {target}, and its pictures beside it: {', '.join(f'{name}.png' for name in pictures)}")
