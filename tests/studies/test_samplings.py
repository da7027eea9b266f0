"""The picture of one scene in every sampling."""

from benchmarks import cli
from PIL import Image

from topleft._core.base.options import Sampling


def test_samplings_command_draws_a_panel_for_each(tmp_path, capsys):
    from benchmarks.small.samplings import ORDER

    assert sorted(ORDER) == sorted(Sampling)
    assert cli.main(["samplings", "-o", str(tmp_path)]) == 0
    with Image.open(capsys.readouterr().out.strip()) as picture:
        assert len(picture.convert("RGB").getcolors(1 << 20)) > 50
