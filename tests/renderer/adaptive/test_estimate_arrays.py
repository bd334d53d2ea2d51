"""An estimate that is put away as arrays: they are read by name, and only as they were written."""

import numpy as np
import pytest

import renderer
from renderer.adaptive import Estimate
from tests.renderer.adaptive.test_estimate import begun, passes, plan_of


def put_away() -> tuple[renderer.RenderPlan, dict[str, np.ndarray]]:
    """What the passes leave up to the first error."""
    plan = plan_of()
    estimate = begun(plan)
    passes(estimate, 3)
    arrays = estimate.arrays()
    assert "error" in arrays
    return plan, arrays


def test_an_estimate_is_restored_by_names_in_whatever_order_they_come() -> None:
    plan, arrays = put_away()
    again = Estimate.restored(plan, dict(reversed(arrays.items()))).arrays()
    assert {name: array.tobytes() for name, array in again.items()} == {
        name: array.tobytes() for name, array in arrays.items()
    }


def test_arrays_that_another_version_has_named_are_refused() -> None:
    plan, arrays = put_away()
    without = {name: array for name, array in arrays.items() if name != "doubts"}
    with pytest.raises(ValueError, match="doubts"):
        Estimate.restored(plan, without)
    with pytest.raises(ValueError, match="surprises"):
        Estimate.restored(plan, arrays | {"surprises": arrays["doubts"]})


def test_numbers_of_an_error_in_another_order_or_without_names_are_refused() -> None:
    plan, arrays = put_away()
    numbers = arrays["error"]
    turned = np.dtype([(name, np.float64) for name in reversed(numbers.dtype.names)])
    for error in (np.array(numbers.item(), dtype=turned), np.array(numbers.item())):
        with pytest.raises(ValueError, match="error"):
            Estimate.restored(plan, arrays | {"error": error})
