% One iteration of EM as Octave loops over frozen tangents: em.m steps.bin, prints seconds and log-likelihood.
1;
function em(path)
  n = 6; p = 4; width = n * n + n + p * n + p;
  file = fopen(path); rows = fread(file, [width, Inf], 'double'); fclose(file);
  T = columns(rows);
  F = permute(reshape(rows(1:36, :), n, n, T), [2 1 3]); b = rows(37:42, :);
  H = permute(reshape(rows(43:66, :), n, p, T), [2 1 3]); y = rows(67:70, :);
  Q = 30 * diag([1e-4 1e-4 1e-5 0.02 0.02 0.01]); R = 0.05 * diag([0.01 0.005 1e-4 0.05]);
  tic;
  prior_m = zeros(n, T); prior_P = zeros(n, n, T); post_m = zeros(n, T); post_P = zeros(n, n, T);
  m = zeros(n, 1); P = eye(n); total = 0;
  for k = 1:T
    prior_m(:, k) = m; prior_P(:, :, k) = P;
    H_k = H(:, :, k); F_k = F(:, :, k);
    S = H_k * P * H_k' + R; e = y(:, k) - H_k * m;
    K = (S \ (H_k * P))';
    total -= 0.5 * (e' * (S \ e) + log(det(S)) + p * log(2 * pi));
    I_KH = eye(n) - K * H_k;
    m = m + K * e; P = I_KH * P * I_KH' + K * R * K';
    post_m(:, k) = m; post_P(:, :, k) = P;
    m = F_k * m + b(:, k); P = F_k * P * F_k' + Q;
  end
  m = post_m(:, T); P = post_P(:, :, T); e = y(:, T) - H(:, :, T) * m;
  S_Q = zeros(n); S_R = e * e' + H(:, :, T) * P * H(:, :, T)';
  for k = T-1:-1:1
    F_k = F(:, :, k); H_k = H(:, :, k);
    J = (prior_P(:, :, k + 1) \ (F_k * post_P(:, :, k)))';
    m_k = post_m(:, k) + J * (m - prior_m(:, k + 1));
    P_k = post_P(:, :, k) + J * (P - prior_P(:, :, k + 1)) * J';
    d = m - F_k * m_k - b(:, k); cross = P * J' * F_k';
    S_Q += d * d' + P - cross - cross' + F_k * P_k * F_k';
    e = y(:, k) - H_k * m_k;
    S_R += e * e' + H_k * P_k * H_k';
    m = m_k; P = P_k;
  end
  Q = S_Q / (T - 1); R = S_R / T;
  printf('%.9g %.12g\n', toc, total);
end
em(argv(){1});
