"""What refining α gains."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from mirrorbake.study.alpha import bounded_step, study
from mirrorbake.study.inference import PLACES


def test_a_step_finds_what_is_lacking_within_the_bounds() -> None:
    random = np.random.default_rng(3)
    rows = sparse.random(200, 40, 0.2, "csr", random_state=random)
    alpha = random.uniform(0.0, 1.0, 40)
    truth = random.uniform(0.0, 1.0, 40)
    step = bounded_step(rows, rows @ (truth - alpha), alpha)
    # A hundredth of damping, and columns that few rows read.
    assert np.abs(alpha + step - truth).mean() < 0.05
    step = bounded_step(rows, rows @ np.full(40, 5.0), alpha)
    np.testing.assert_allclose(alpha + step, 1.0, atol=1e-6)


def test_refining_moves_alpha_alone_and_stays_near() -> None:
    found = study(32, 16, 16)
    for place in PLACES:
        assert found["refined"][place] != found["layers' own"][place]
        # In a picture of this size a step is mostly noise: tenths of a decibel.
        assert abs(found["refined"][place] - found["layers' own"][place]) < 1.5
