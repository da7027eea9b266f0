"""Where PyTorch is not installed, `topleft.torch` says how to get it."""

import subprocess
import sys


def test_import_without_torch_says_how_to_get_it():
    code = "import sys; sys.modules['torch'] = None\ntry: import topleft.torch\nexcept ImportError as e: print(e)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "topleft.torch needs PyTorch: pip install torch\n"
