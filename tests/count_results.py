"""Prints "PASSED FAILED" of one pytest run, from its junit file and its exit status.

    python3 tests/count_results.py RESULTS.xml STATUS

A run that died, or that ended badly without a failed test, counts one failure more. Skipped tests count as neither.
"""

import sys
import xml.etree.ElementTree as ElementTree


def count(path, status):
    """(passed, failed) of the file; `status` is what the run exited with."""
    try:
        suites = ElementTree.parse(path).getroot().iter("testsuite")
    except (OSError, ElementTree.ParseError):
        return 0, 1
    total = bad = skipped = 0
    for suite in suites:
        total += int(suite.get("tests", 0))
        bad += int(suite.get("failures", 0)) + int(suite.get("errors", 0))
        skipped += int(suite.get("skipped", 0))
    passed = max(total - bad - skipped, 0)
    return passed, bad or int(status != 0)


if __name__ == "__main__":
    print(*count(sys.argv[1], int(sys.argv[2])))
