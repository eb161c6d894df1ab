"""Questions of experiments/accuracy_on_request.py."""

import importlib
import sys

from tests.experiments.contract import FOLDER

sys.path.insert(0, str(FOLDER))
try:
    _module = importlib.import_module("_accuracy_blast")
finally:
    sys.path.remove(str(FOLDER))

blast_question, dropped_question = _module.blast_question, _module.dropped_question
