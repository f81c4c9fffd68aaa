"""One iteration of EM as NumPy loops over frozen tangents: em.py steps.bin [jit], prints seconds and log-likelihood."""
import sys
import time

import numpy as np

if "jit" in sys.argv:
    from numba import njit
else:
    def njit(function):
        return function


@njit
def forward(F, b, H, y, m, P, Q, R):
    T, n = b.shape
    prior_m, prior_P = np.zeros((T, n)), np.zeros((T, n, n))
    post_m, post_P = np.zeros((T, n)), np.zeros((T, n, n))
    identity, total = np.eye(n), 0.0
    for k in range(T):
        prior_m[k], prior_P[k] = m, P
        S = H[k] @ P @ H[k].T + R
        e = y[k] - H[k] @ m
        K = np.linalg.solve(S, H[k] @ P).T
        total -= 0.5 * (e @ np.linalg.solve(S, e) + np.log(np.linalg.det(S)) + e.size * np.log(2 * np.pi))
        I_KH = identity - K @ H[k]
        m, P = m + K @ e, I_KH @ P @ I_KH.T + K @ R @ K.T
        post_m[k], post_P[k] = m, P
        m, P = F[k] @ m + b[k], F[k] @ P @ F[k].T + Q
    return prior_m, prior_P, post_m, post_P, total


@njit
def backward(F, b, H, y, prior_m, prior_P, post_m, post_P):
    T, n = b.shape
    m, P = post_m[T - 1], post_P[T - 1]
    e = y[T - 1] - H[T - 1] @ m
    Q, R = np.zeros((n, n)), np.outer(e, e) + H[T - 1] @ P @ H[T - 1].T
    for k in range(T - 2, -1, -1):
        J = np.linalg.solve(prior_P[k + 1], F[k] @ post_P[k]).T
        m_k = post_m[k] + J @ (m - prior_m[k + 1])
        P_k = post_P[k] + J @ (P - prior_P[k + 1]) @ J.T
        d, cross = m - F[k] @ m_k - b[k], P @ J.T @ F[k].T
        Q += np.outer(d, d) + P - cross - cross.T + F[k] @ P_k @ F[k].T
        e = y[k] - H[k] @ m_k
        R += np.outer(e, e) + H[k] @ P_k @ H[k].T
        m, P = m_k, P_k
    return Q / (T - 1), R / T


def main():
    n, p = 6, 4
    rows = np.fromfile(sys.argv[1]).reshape(-1, n * n + n + p * n + p)
    F, b, H, y = (np.ascontiguousarray(part) for part in np.split(rows, np.cumsum([n * n, n, p * n]), axis=1))
    F, H = F.reshape(-1, n, n), H.reshape(-1, p, n)
    Q = 30 * np.diag([1e-4, 1e-4, 1e-5, 0.02, 0.02, 0.01])
    R = 0.05 * np.diag([0.01, 0.005, 1e-4, 0.05])
    for warm in (50, None):
        part = [a[:warm] for a in (F, b, H, y)]
        begun = time.perf_counter()
        *passed, total = forward(*part, np.zeros(n), np.eye(n), Q, R)
        backward(*part, *passed)
        seconds = time.perf_counter() - begun
    print(seconds, repr(float(total)))


main()
