"""Fits a recurrent network with jax-sysid; runs in that package's own environment and imports nothing of this project.

    python recurrent_fit.py IN.npz OUT.npz

    x(k+1) = A x(k) + B v(k) + V tanh(W [x(k); v(k)] + b),  w(k) = C x(k)

IN has the arrays A (n, n), B (n, 3), C (1, n), V (n, m), W (m, n + 3), b (m,) to begin with, v (samples, 3), w (samples, 1),
and the numbers of iterations adam and lbfgs.
OUT has the six arrays fitted to all samples at once, by the error of the simulation.
"""

from __future__ import annotations

import sys

import jax
import jax.numpy as jnp
import numpy as np

jax.config.update("jax_enable_x64", True)

from jax_sysid.models import Model  # noqa: E402

NAMES = ("A", "B", "C", "V", "W", "b")
SMALL = 1e-6
"""Price of the squared weights of the network: of the squared error, both with an rms of about 1."""


@jax.jit
def state(x, v, p):  # type: ignore[no-untyped-def]
    return p[0] @ x + p[1] @ v + p[3] @ jnp.tanh(p[4] @ jnp.hstack((x, v)) + p[5])


@jax.jit
def output(x, v, p):  # type: ignore[no-untyped-def]
    return p[2] @ x


def main() -> None:
    given = np.load(sys.argv[1])
    model = Model(len(given["A"]), 1, given["v"].shape[1], state_fcn=state, output_fcn=output)
    model.init(params=[jnp.array(given[name]) for name in NAMES], x0=jnp.zeros(len(given["A"])))
    model.loss(rho_x0=0.0, rho_th=0.0, train_x0=False,
               custom_regularization=lambda p, x0: SMALL * (jnp.sum(p[3] ** 2) + jnp.sum(p[4] ** 2)))  # fmt: skip
    model.optimization(adam_eta=1e-3, adam_epochs=int(given["adam"]), lbfgs_epochs=int(given["lbfgs"]), iprint=-1)
    model.fit(given["w"], given["v"])
    np.savez(sys.argv[2], **dict(zip(NAMES, map(np.asarray, model.params), strict=True)))


if __name__ == "__main__":
    main()
