"""The code that docs/export.md shows, run as it is on an exported flight."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from companion.commands.export import ExportRequest, run_export

PAGE = Path(__file__).parents[3] / "docs" / "export.md"
BLOCKS = re.findall(r"^```python\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.M | re.S)


@pytest.mark.parametrize("code", BLOCKS, ids=["figure", "pandas"])
def test_the_code_that_the_page_shows_runs(code, flown_once, tmp_path):
    if "pandas" in code:
        pytest.importorskip("pandas")
    run_export(ExportRequest(flown_once, out=tmp_path / "flights" / "first" / "parquet"))
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={"MPLBACKEND": "agg", "MPLCONFIGDIR": str(tmp_path), "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    if "savefig" in code:
        assert (tmp_path / "tracking.png").stat().st_size > 10_000
    else:
        assert "track" in done.stdout
