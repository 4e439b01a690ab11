"""The process that reads STEP: as `child`, but that OpenCASCADE writes files in memory, by names in /proc/self/fd."""

from service.formats.sandbox.child import main

if __name__ == "__main__":
    main(writes_memory=True)
