"""store_study_test.py SCRIPT: tools/store_study on a study made up here, in a folder of its own."""

import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

script = pathlib.Path(sys.argv[1])

study = {
    "study": "made_up", "title": "Made up", "question": "Does it?", "version": "0.1.0", "wall_s": 7200.0,
    "error_set": {"numerics.element_length": "1"}, "parameters": ["loom.tension"],
    "figures": [
        {"key": "weave.stress_max_Pa", "lowest": 1e8, "highest": 3e8, "error_max": 5e6, "differs_by_more_than_errors": True},
        {"key": "weave.crimp_warp", "lowest": 0.1, "highest": 0.11, "error_max": 0.02, "differs_by_more_than_errors": False},
        {"key": "weave.energy_J.bars", "lowest": 2e-3, "highest": 4e-3},
        {"key": "relax.converged"},
    ],
    "runs": [
        {"name": f"tension_{i}N", "state": "finished", "parameters": {"loom.tension": f"{i} N"},
         "figures": {"weave.stress_max_Pa": i * 1e8, "weave.crimp_warp": 0.09 + 0.01 * i, "weave.energy_J.bars": 2e-3 * i, "relax.converged": i == 1},
         "errors": {"weave.stress_max_Pa": 5e6} if i == 1 else {}, "second": {"name": f"tension_{i}N_second", "state": "finished"}}
        for i in (1, 2)
    ],
    "references": [{"key": "weave.stress_max_Pa", "value": 2e8, "tolerance": 1e7, "source": "a book", "where": {"loom.tension": "1 N"}}],
}

with tempfile.TemporaryDirectory() as name:
    root = pathlib.Path(name)
    folder, results = root / "cases/studies/made_up", root / "out"
    for made in (root / "tools", folder, results / "pictures"):
        made.mkdir(parents=True)
    shutil.copy(script, root / "tools/store_study")
    (folder / "study.toml").write_text("")
    (folder / "README.md").write_text("# Made up\n\nDoes it?\n")
    (results / "study.csv").write_text("run\n")
    for picture in ("weave_stress_max_Pa_by_loom_tension", "weave_section_y", "weave_top", "relax_section_y", "weave_crimp_warp_by_loom_tension"):
        (results / f"pictures/{picture}.png").write_bytes(b"png")

    def store(*arguments):
        (results / "study.json").write_text(json.dumps(study))
        return subprocess.run([root / "tools/store_study", *arguments], capture_output=True, text=True, check=False)

    assert store("made_up", results, "It does.").returncode == 0
    text = (folder / "README.md").read_text()
    for line in [
        "# Made up\n\nDoes it?\n\n## The study to its end\n\nIt does.\n\n",
        "By more than the errors of two runs together differ: weave stress max [MPa] 100 to 300 ± 5. ",
        "Not by more than these, so no trend: weave crimp warp 0.1 to 0.11 ± 0.02. ",
        "Of unknown error: weave energy bars [mJ] 2 to 4.\n",
        "| figure | tension_1N | tension_2N |\n|---|---|---|\n| weave stress max [MPa] | 100 ± 5 | 200 |\n",
        "| weave energy bars [mJ] | 2 | 4 |\n| relax converged | yes | no |\n",
        "- weave stress max [MPa], loom.tension 1 N: 200 ± 10 (a book)\n",
        "](results/weave_stress_max_Pa_by_loom_tension.png)\n\n![Sections along the warps, relaxed](results/relax_section_y.png)\n",
        "2.0 h of wall time over all runs",
    ]:
        assert line in text, (line, text)
    assert "weave_crimp" not in text
    kept = sorted(p.name for p in (folder / "results").iterdir())
    assert len(kept) == 7 and "study.json" in kept and "study.csv" in kept, kept

    # Again: the section is replaced, what the author wrote below it stays, and a picture that is no longer drawn goes.
    (folder / "README.md").write_text(text + "\n## Beside it\n\nMore.\n")
    (results / "pictures/weave_crimp_warp_by_loom_tension.png").unlink()
    assert store("made_up", results).returncode == 0
    again = (folder / "README.md").read_text()
    assert again.count("## The study to its end") == 1 and again.endswith("\n## Beside it\n\nMore.\n") and "It does." not in again, again
    assert not (folder / "results/weave_crimp_warp_by_loom_tension.png").exists()

    # What is not finished, or of another study, is refused, and nothing is changed.
    study["runs"][1]["second"]["state"] = "interrupted"
    refused = store("made_up", results)
    assert refused.returncode == 1 and "did not come to its end: tension_2N_second" in refused.stderr, refused.stderr
    study["study"] = "other"
    refused = store("made_up", results)
    assert refused.returncode == 1 and "holds the study other" in refused.stderr, refused.stderr
    assert (folder / "README.md").read_text() == again
    assert store("made_up").returncode == 1
