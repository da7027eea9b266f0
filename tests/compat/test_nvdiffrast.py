"""Programs for nvdiffrast that name CUDA run as they are."""

import subprocess
import sys

import pytest

pytest.importorskip("torch")

PROGRAM = """
import sys
import torch
import nvdiffrast.torch as dr

device = torch.device("cuda:0")
dr.set_log_level(2)
glctx = dr.RasterizeGLContext(output_db=True, mode="manual", device="cuda")
glctx.set_context()
pos = torch.tensor([[[-0.8, -0.8, 0, 1], [0.8, -0.8, 0, 1], [-0.8, 0.8, 0, 1]]], device="cuda")
tri = torch.tensor([[0, 1, 2]], dtype=torch.int32).cuda()
colors = torch.nn.Parameter(torch.eye(3, device=device))
rast, _ = dr.rasterize(glctx, pos.to("cuda"), tri, resolution=[16, 16])
out, _ = dr.interpolate(colors.cuda(), rast, tri)
net = torch.nn.Linear(3, 1).cuda().to(device)
net(out).sum().backward()
torch.cuda.synchronize()
glctx.release_context()
print(sys.argv[1:], dr.get_log_level(), int((rast[..., 3] > 0).sum()), bool(colors.grad.any()), colors.device)
"""


def test_program_that_names_cuda_runs(tmp_path):
    tmp_path.joinpath("program.py").write_text(PROGRAM)
    command = [sys.executable, "-m", "topleft.compat", "nvdiffrast", str(tmp_path / "program.py"), "--steps", "3"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.stderr == "topleft.compat: calls for 'cuda' run on the CPU\n"
    assert done.stdout == "['--steps', '3'] 2 66 True cpu\n"
