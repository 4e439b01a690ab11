"""`python -m service.cli`: the command line."""

from service.cli.program import program

if __name__ == "__main__":
    raise SystemExit(program())
