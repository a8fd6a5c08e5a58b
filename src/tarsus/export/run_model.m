% Make the run of model.mat again, from event to event, and compare it with events.csv.
%
%   run_model            in MATLAB or GNU Octave, in this folder
%
% Between events x'' = inv(M) (weight + L f - K x - C v + sum of foot forces), with held feet kept on the ground; the film
% enters through its momentum P(gap), whose rate is the force: with u = v - Q sum n_i P_i nothing is differentiated.
% found: rows of time [s], foot (from 1), kind (1 bounce, 2 capture, 3 release, 4 rest, 5 contact at start, 9 averaged).

function found = run_model()
  here = fileparts(mfilename('fullpath'));
  addpath(here);
  m = load(fullfile(here, 'model.mat'));
  if ~m.runs
    fprintf('this script does not run this robot: %s\n', m.reason);
    found = zeros(0, 3);
    return
  end
  m.Minv = inv(m.mass);
  m.law = laws();
  s = struct('t', 0, 'x', m.x0(:), 'v', m.v0(:), 'held', false(1, m.feet), 'since', zeros(1, m.feet));
  s.armed = gaps(m, s.x) > m.tiny;
  found = zeros(0, 3);
  for i = find(~s.armed)
    rate = m.normals(:, i)' * s.v;
    if rate < -1e-12 * m.length * m.rate
      [s, found] = touch(m, s, i, found);
    elseif abs(rate) <= 1e-12 * m.length * m.rate && pull_if_held(m, s, i) <= m.law.strength(0)
      found(end + 1, :) = [s.t, i, 5];
      s = hold_foot(m, s, i);
    end
  end
  for k = 1:numel(m.knots) - 1
    m = pieces_at(m, 0.5 * (m.knots(k) + m.knots(k + 1)));
    [s, found] = march(m, s, m.knots(k + 1), found);
  end
  found = sortrows(found, 1);
  report(found, m.events);
end

function [s, found] = march(m, s, stop, found)
  h = min(0.1 / m.rate, stop - s.t);
  while s.t < stop
    for i = find(s.held)
      if margin(m, s, i) < 0
        found(end + 1, :) = [s.t, i, 3];
        s.held(i) = false;
        s.armed(i) = false;
      end
    end
    [Q, S] = flows(m, s.held);
    y = [s.x; s.v - momenta(m, s, s.x, Q)];
    h = min([h, 0.3 / m.rate, stop - s.t]);
    [z, err] = step(m, s, Q, S, y, s.t, h);
    while err > 1
      h = h * max(0.2, 0.9 * err ^ -0.2);
      [z, err] = step(m, s, Q, S, y, s.t, h);
    end
    [what, share] = first_event(m, s, Q, S, y, h, z);
    if what ~= 0
      z = step(m, s, Q, S, y, s.t, share * h);
    end
    last = stop - s.t <= h * share * (1 + 1e-12);
    s.t = s.t + share * h;
    if last && what == 0
      s.t = stop;
    end
    n = numel(s.x);
    s.x = z(1:n);
    s.v = z(n + 1:end) + momenta(m, s, s.x, Q);
    s.armed = s.armed | (gaps(m, s.x) > m.tiny);
    grown = h * min(2, max(0.3, 0.9 * max(err, 1e-10) ^ -0.2));
    if what > 0
      [s, found, longest] = touch(m, s, what, found);
      grown = min(grown, longest);
    elseif what < 0
      found(end + 1, :) = [s.t, -what, 3];
      s.held(-what) = false;
      s.armed(-what) = false;
      grown = 1e-3 / m.rate;
    end
    h = grown;
  end
end

function [what, share] = first_event(m, s, Q, S, y, h, z)
  what = 0;
  share = 1;
  for i = 1:m.feet
    if ~watched(m, s, Q, i, z, s.t + h)
      continue
    end
    low = 0;
    high = share;
    if watched(m, s, Q, i, step(m, s, Q, S, y, s.t, high * h), s.t + high * h)
      for turn = 1:60
        middle = 0.5 * (low + high);
        if watched(m, s, Q, i, step(m, s, Q, S, y, s.t, middle * h), s.t + middle * h)
          high = middle;
        else
          low = middle;
        end
        if high - low < 1e-13
          break
        end
      end
      share = high;
      what = i;
      if s.held(i)
        what = -i;
      end
    end
  end
end

function yes = watched(m, s, Q, i, z, t)
% Whether a free foot is below the ground, or a held one pulled harder than it is held.
  n = numel(s.x);
  if s.held(i)
    s.t = t;
    s.x = z(1:n);
    s.v = z(n + 1:end) + momenta(m, s, s.x, Q);
    yes = margin(m, s, i) < 0;
  else
    yes = s.armed(i) && m.gap(i) + m.normals(:, i)' * z(1:n) < 0;
  end
end

function g = gaps(m, x)
  g = m.gap(:)' + (m.normals' * x)';
end

function [Q, S] = flows(m, held)
% S: inverse of the mass for what held feet leave; Q is the same, for the momenta of films.
  N = m.normals(:, held);
  S = m.Minv;
  if ~isempty(N)
    S = S - S * N * pinv(N' * S * N) * N' * S;
  end
  Q = S;
end

function p = momenta(m, s, x, Q)
  p = zeros(numel(x), 1);
  for i = find(~s.held)
    p = p + Q * m.normals(:, i) * m.law.momentum(max(m.gap(i) + m.normals(:, i)' * x, 0));
  end
end

function r = rates(m, s, Q, S, y, t)
  n = numel(s.x);
  x = y(1:n);
  v = y(n + 1:end) + momenta(m, s, x, Q);
  push = m.weight(:) - m.stiffness * x - m.damping * v;
  if ~isempty(m.loads)
    push = push + m.loads * drive(m, t);
  end
  for i = find(~s.held)
    normal = m.normals(:, i);
    gap = max(m.gap(i) + normal' * x, 0);
    push = push + normal * m.law.force(gap, normal' * v, volts(m, i, t), t);
  end
  r = [v; S * push];
end

function [z, err] = step(m, s, Q, S, y, t, h)
% Dormand and Prince, orders 5 and 4.
  f = @(c, d) rates(m, s, Q, S, d, t + c * h);
  k1 = f(0, y);
  k2 = f(1/5, y + h * k1 / 5);
  k3 = f(3/10, y + h * (3/40 * k1 + 9/40 * k2));
  k4 = f(4/5, y + h * (44/45 * k1 - 56/15 * k2 + 32/9 * k3));
  k5 = f(8/9, y + h * (19372/6561 * k1 - 25360/2187 * k2 + 64448/6561 * k3 - 212/729 * k4));
  k6 = f(1, y + h * (9017/3168 * k1 - 355/33 * k2 + 46732/5247 * k3 + 49/176 * k4 - 5103/18656 * k5));
  z = y + h * (35/384 * k1 + 500/1113 * k3 + 125/192 * k4 - 2187/6784 * k5 + 11/84 * k6);
  if nargout < 2
    return
  end
  k7 = f(1, z);
  e = h * (71/57600 * k1 - 71/16695 * k3 + 71/1920 * k4 - 17253/339200 * k5 + 22/525 * k6 - k7 / 40);
  n = numel(s.x);
  scale = [m.scale(:); m.scale(:) * m.rate];
  err = norm(e ./ (1e-9 * (scale + abs(y)))) / sqrt(2 * n);
end

function m = pieces_at(m, t)
% The pieces of the drives that hold around a moment.
  for c = 1:numel(m.starts)
    m.now(c) = max(sum(m.starts{c} <= t), 1);
    m.now(c) = min(m.now(c), size(m.coefs{c}, 1));
  end
end

function f = channel(m, c, t)
  p = m.now(c);
  a = m.starts{c}(p);
  b = m.starts{c}(p + 1);
  f = polyval(fliplr(m.coefs{c}(p, :)), 2 * (t - a) / (b - a) - 1);
end

function f = drive(m, t)
  f = zeros(m.drives, 1);
  for d = 1:m.drives
    f(d) = channel(m, d, t);
  end
end

function u = volts(m, i, t)
  u = 0;
  if m.wired(i) > 0
    u = channel(m, m.wired(i), t);
  end
end

function r = reactions(m, s)
% Force of the structure on every held foot.
  push = m.weight(:) - m.stiffness * s.x - m.damping * s.v;
  if ~isempty(m.loads)
    push = push + m.loads * drive(m, s.t);
  end
  for i = find(~s.held)
    normal = m.normals(:, i);
    gap = max(m.gap(i) + normal' * s.x, 0);
    d = 1e-6 * (gap + m.length);
    slope = (m.law.momentum(gap + d) - m.law.momentum(max(gap - d, 0))) / (gap + d - max(gap - d, 0));
    rate = normal' * s.v;
    push = push + normal * (slope * rate + m.law.force(gap, rate, volts(m, i, s.t), s.t));
  end
  N = m.normals(:, s.held);
  r = zeros(1, m.feet);
  r(s.held) = pinv(N' * m.Minv * N) * (N' * m.Minv * push);
end

function a = margin(m, s, i)
  r = reactions(m, s);
  a = m.law.strength(s.t - s.since(i)) - r(i) - m.law.force(0, 0, volts(m, i, s.t), s.t);
end

function p = pull_if_held(m, s, i)
% Pull on a foot if it were stopped on the ground now.
  normal = m.normals(:, i);
  [~, S] = flows(m, s.held);
  s.v = s.v - S * normal * (normal' * s.v) / (normal' * S * normal);
  s.held(i) = true;
  r = reactions(m, s);
  p = r(i) + m.law.force(0, 0, volts(m, i, s.t), s.t);
end

function s = hold_foot(m, s, i)
  normal = m.normals(:, i);
  s.x = s.x - m.Minv * normal * (m.gap(i) + normal' * s.x) / (normal' * m.Minv * normal);
  s.held(i) = true;
  s.since(i) = s.t;
end

function [s, found, longest] = touch(m, s, i, found)
% A foot is at the ground and approaches it: the landing rule decides.
  longest = inf;
  normal = m.normals(:, i);
  speed = -normal' * s.v;
  [~, S] = flows(m, s.held);
  response = S * normal;
  mobility = normal' * response;
  pull = pull_if_held(m, s, i);
  small = max(1e-9 * max(m.gap), 1e-12);
  after = m.law.rebound(speed);
  if any(s.held) && (pull >= 0 || speed ^ 2 >= -2 * pull * mobility * small)
    N = m.normals(:, s.held);
    carried = -pinv(N' * m.Minv * N) * (N' * m.Minv * normal);
    [least, k] = min(carried);
    if least < -1e-12
      held = find(s.held);
      found(end + 1, :) = [s.t, held(k), 3];
      s.held(held(k)) = false;
      s.armed(held(k)) = false;
      [s, found, longest] = touch(m, s, i, found);
      return
    end
  end
  low = pull < 0 && after ^ 2 < -2 * pull * mobility * small;
  if m.restitutes_first
    kept = pull <= m.law.strength(0) && after <= m.landing_speed;
  else
    kept = m.adheres && pull <= m.law.strength(0);
    low = low && ~m.adheres;
  end
  if kept || (low && after == 0)
    kind = 2;
  elseif ~low
    kind = 1;
  elseif after <= (1 - 1/1024) * speed
    kind = 4;
  else
    kind = 9;
  end
  s.armed(i) = false;
  if kind == 1
    found(end + 1, :) = [s.t, i, 1];
    s.v = s.v + response / mobility * (speed + after);
    if pull < 0
      longest = 0.5 * after / (-pull * mobility);
    end
    return
  end
  over = s.t;
  if kind == 4
    over = s.t - 2 * after / (pull * mobility) / (1 - after / speed);
  end
  found(end + 1, :) = [over, i, kind];
  s.v = s.v + response / mobility * speed;
  s = hold_foot(m, s, i);
end

function report(found, events)
% Events are compared in order until one differs in foot or kind.
  count = min(size(found, 1), size(events, 1));
  same = 0;
  while same < count && all(found(same + 1, 2:3) == events(same + 1, 2:3))
    same = same + 1;
  end
  off = 0;
  if same > 0
    off = max(abs(found(1:same, 1) - events(1:same, 1)));
  end
  fprintf('%d events here, %d in events.csv; the first %d are the same, their times to %.3g s\n', ...
          size(found, 1), size(events, 1), same, off);
end
