"""The inverse of a Gram matrix, whatever the units of its columns."""

from __future__ import annotations

import numpy as np

from gaident.estimation.projection import inverse_of

SIZES = np.array([1e-9, 1.0, 1e8])


def test_columns_of_any_units_count_alike() -> None:
    columns = np.random.default_rng(0).standard_normal((40, 3))
    expected = np.linalg.inv(columns.T @ columns)
    gram = (columns * SIZES).T @ (columns * SIZES)
    np.testing.assert_allclose(inverse_of(gram) * np.outer(SIZES, SIZES), expected, rtol=1e-9)


def test_what_columns_do_not_show_is_0() -> None:
    """A column of 0, and the difference of two columns that are alike in different units."""
    a, b = np.random.default_rng(1).standard_normal((2, 40))
    sizes = np.array([1e-6, 1.0, 1.0, 1e6])
    columns = np.column_stack([a, np.zeros(40), b, b]) * sizes
    found = inverse_of(columns.T @ columns) * np.outer(sizes, sizes)
    np.testing.assert_allclose(found @ [0.0, 0.0, 1.0, -1.0], 0.0, atol=1e-12)
    np.testing.assert_allclose(found[1], 0.0, atol=1e-12)
    np.testing.assert_allclose(found[2:, 2:], 0.25 / (b @ b), rtol=0.2)


def test_other_sizes_may_be_given() -> None:
    """A column that is rounding beside its size is not shown."""
    a, rounding = np.random.default_rng(2).standard_normal((2, 40)) * np.array([[1.0], [1e-15]])
    columns = np.column_stack([a, rounding])
    found = inverse_of(columns.T @ columns, np.full(2, float(np.linalg.norm(a))))
    np.testing.assert_allclose(found[0, 0], 1.0 / (a @ a))
    assert found[1, 1] < found[0, 0] < inverse_of(columns.T @ columns)[1, 1]
