// SPDX-License-Identifier: Apache-2.0
// Sneddon's integrals of any axisymmetric profile, by Gauss-Legendre in theta with r = a sin(theta), which
// takes the square root out of the edge. Panels end where the slope of the profile breaks, and are graded
// towards the edge of a contact that comes close to a tangent end. Forces are over the reduced modulus.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <numbers>

namespace needleforce {

/// A profile f(r) with f(0) = 0: its slope f'(r) >= 0, the radii where the slope breaks, in ascending order
/// (those beyond the contact are not looked at), and the radius where it ends, infinity if never. A profile
/// that ends tangent to the shank, its slope like 1 / sqrt(end - r), declares it by `static constexpr bool
/// tangent`.
template <class P>
concept AxisymmetricProfile = requires(const P& profile, double r) {
  { profile.slope(r) } noexcept -> std::same_as<double>;
  { profile.end() } noexcept -> std::same_as<double>;
  profile.breaks();
};

namespace sneddon {

/// Depth [m] and force over reduced modulus [m^2] at a contact radius.
struct Touch {
  double depth;
  double force;
};

/// Nodes and weights of 16-point Gauss-Legendre on [-1, 1]; the other half mirrors them.
inline constexpr struct {
  double node, weight;
} gauss[8] = {
    {0.09501250983763744018, 0.18945061045506849628}, {0.28160355077925891323, 0.18260341504492358886},
    {0.45801677765722738634, 0.16915651939500253818}, {0.61787624440264374844, 0.14959598881657673208},
    {0.75540440835500303389, 0.12462897125553387205}, {0.86563120238783174388, 0.09515851168249278480},
    {0.94457502307323257607, 0.06225352393864789286}, {0.98940093499164993259, 0.02715245941175409485},
};

template <class P>
consteval bool is_tangent() {
  if constexpr (requires { P::tangent; })
    return P::tangent;
  else
    return false;
}

/// The largest contact radius [m] a tip is asked for: its end, or so close to a tangent end, where the depth
/// is infinite, that the slope of the force there differs from its limit by 1e-12.
template <class P>
double last_radius(const P& profile) noexcept {
  return is_tangent<P>() ? profile.end() * (1.0 - 0x1p-40) : profile.end();
}

namespace detail {

/// sin(x) by its series, exact in double for |x| <= pi/4: a call would keep the panel from being vectorised.
constexpr double sine(double x) noexcept {
  const double y = x * x;
  return x * (1 + y * (-1 / 6.0 +
                       y * (1 / 120.0 +
                            y * (-1 / 5040.0 +
                                 y * (1 / 362880.0 + y * (-1 / 39916800.0 +
                                                          y * (1 / 6227020800.0 - y / 1307674368000.0)))))));
}
constexpr double cosine(double x) noexcept {
  const double y = x * x;
  return 1 + y * (-0.5 + y * (1 / 24.0 +
                              y * (-1 / 720.0 + y * (1 / 40320.0 + y * (-1 / 3628800.0 +
                                                                        y * (1 / 479001600.0 +
                                                                             y * (-1 / 87178291200.0 +
                                                                                  y / 20922789888000.0)))))));
}

/// Sine and cosine of the nodes of a panel that is a whole quarter, from its middle.
inline constexpr auto quarter = [] {
  std::array<std::array<double, 2>, 8> nodes{};
  for (std::size_t i = 0; i < nodes.size(); ++i)
    nodes[i] = {sine(0.25 * std::numbers::pi * gauss[i].node),
                cosine(0.25 * std::numbers::pi * gauss[i].node)};
  return nodes;
}();

/// The panel [middle - half, middle + half], its nodes' sine and cosine from `nodes(i)`.
template <class P, class Nodes>
Touch panel(const P& profile, double a, double middle, double half, Nodes nodes) noexcept {
  const double sine_middle = std::sin(middle), cosine_middle = std::cos(middle);
  Touch sum{0.0, 0.0};
  for (std::size_t i = 0; i < 8; ++i) {
    const auto [sine_i, cosine_i] = nodes(i);
    const double across = sine_middle * cosine_i, along = cosine_middle * sine_i;
    const double above = across + along, below = across - along;
    const double rise = profile.slope(a * above), other = profile.slope(a * below);
    sum.depth += gauss[i].weight * (rise + other);
    sum.force += gauss[i].weight * (above * above * rise + below * below * other);
  }
  return {half * sum.depth, half * sum.force};
}

/// Integrals of f' and f' sin^2 over theta in [low, high], at most pi/2 wide.
template <class P>
Touch panel(const P& profile, double a, double low, double high) noexcept {
  const double middle = 0.5 * (low + high), half = 0.5 * (high - low);
  if (half == 0.25 * std::numbers::pi)
    return panel(profile, a, middle, half, [](std::size_t i) { return quarter[i]; });
  return panel(profile, a, middle, half, [half](std::size_t i) {
    return std::array{sine(half * gauss[i].node), cosine(half * gauss[i].node)};
  });
}

/// Calls visit(low, high) for panels from `low` to `high`, ever smaller by 4 towards `high` down to `least`.
template <class Visit>
void graded(double low, double high, double least, Visit visit) noexcept {
  double left = high - low;
  for (; left > least && left > 1e-15 * high; left *= 0.25) visit(high - left, high - 0.25 * left);
  if (left > 0.0) visit(high - left, high);
}

/// Integral of `f` over [low, high]; `rooted` where f may rise like a square root from `low`.
template <class F>
double integral(double low, double high, bool rooted, F f) noexcept {
  double sum = 0.0;
  for (const auto& [node, weight] : gauss)
    for (const double x : {0.5 * (1.0 - node), 0.5 * (1.0 + node)})
      sum += weight * (rooted ? 2.0 * x * f(low + (high - low) * x * x) : f(low + (high - low) * x));
  return 0.5 * (high - low) * sum;
}

/// Where a function that rises from <= 0 at `low` to >= 0 at `high` is within `small` of 0, or changes its
/// sign within the last digits: Chandrupatla's bracketed method.
template <class F>
double root(F f, double low, double high, double small) noexcept {
  double a = high, fa = f(high), b = low, fb = f(low), c = a, fc = fa, t = 0.5;
  if (fb >= 0.0) return low;
  if (fa <= 0.0) return high;
  for (int i = 0; i < 200; ++i) {
    const double x = a + t * (b - a), fx = f(x);
    if ((fx > 0.0) == (fa > 0.0)) {
      c = a, fc = fa;
    } else {
      c = b, fc = fb, b = a, fb = fa;
    }
    a = x, fa = fx;
    const double best = std::abs(fa) < std::abs(fb) ? a : b;
    const double tolerance = 2.0 * std::numeric_limits<double>::epsilon() * std::abs(best);
    const double share = 0.5 * tolerance / std::abs(b - a);
    if (std::abs(fx) <= small || !(share < 0.5)) return best;
    const double xi = (a - b) / (c - b), phi = (fa - fb) / (fc - fb);
    const bool inverse_quadratic = phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi;
    t = inverse_quadratic
            ? fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
            : 0.5;
    t = std::clamp(t, share, 1.0 - share);
  }
  return a;
}

}  // namespace detail

/// Depth and force at contact radius a > 0, by quadrature, to 1e-12. 60 to 100 ns for a panel.
template <AxisymmetricProfile P>
Touch touch(const P& profile, double a) noexcept {
  Touch sum{0.0, 0.0};
  double low = 0.0;
  const auto add = [&](double from, double to) {
    const Touch part = detail::panel(profile, a, from, to);
    sum.depth += part.depth;
    sum.force += part.force;
  };
  for (const double radius : profile.breaks()) {
    if (!(radius > 0.0 && radius < a)) continue;
    const double high = std::asin(radius / a);
    add(low, high);
    low = high;
  }
  constexpr double edge = 0.5 * std::numbers::pi;
  // the singularity of a tangent end is 2 (end / a - 1) to the power 1/2 beyond the edge, off the real axis
  const double least = is_tangent<P>() ? 2.0 * std::sqrt(2.0 * std::max(profile.end() / a - 1.0, 0.0)) : 4.0;
  detail::graded(low, edge, least, add);
  return {a * sum.depth, 2.0 * a * a * sum.force};
}

/// Depth [m] at contact radius a: the tip's own closed form, otherwise by quadrature.
template <class P>
double depth(const P& profile, double a) noexcept {
  if constexpr (requires { profile.depth(a); })
    return profile.depth(a);
  else
    return a > 0.0 ? touch(profile, a).depth : 0.0;
}

/// Contact radius [m] at depth h > 0, at most last_radius(): bracketed, to the last digits.
template <class P>
double contact_radius(const P& profile, double h, double first = 0.0) noexcept {
  const double last = last_radius(profile), small = 4e-15 * h;
  if constexpr (is_tangent<P>()) {
    // h grows like the artanh of a share of the end: in that measure it is nearly straight
    const double end = profile.end();
    const auto miss = [&](double v) { return depth(profile, std::min(end * std::tanh(v), last)) - h; };
    const double low = miss(1.0) < 0.0 ? 1.0 : 0.0;
    return std::min(end * std::tanh(detail::root(miss, low, low > 0.0 ? 15.0 : 1.0, small)), last);
  } else {
    double high = std::isfinite(last) ? last : std::max(first, h);
    // a profile without end: from the depth outwards until it is deep enough
    for (int i = 0; i < 2000 && !std::isfinite(last) && depth(profile, high) < h; ++i) high *= 2.0;
    return detail::root([&](double a) { return depth(profile, a) - h; }, first, high, small);
  }
}

/// Stored energy over reduced modulus [m^3] at depth h and contact radius a: the integral of (h - g)^2, where
/// g(s) is the depth at contact radius s (Galin). It holds beyond saturation too.
template <class P>
double energy(const P& profile, double h, double a) noexcept {
  double sum = 0.0, low = 0.0;
  bool rooted = false;
  const auto square = [&](double s) {
    const double left = h - depth(profile, s);
    return left * left;
  };
  const auto add = [&](double from, double to) {
    sum += detail::integral(from, to, rooted, square);
    rooted = false;
  };
  for (const double radius : profile.breaks()) {
    if (!(radius > 0.0 && radius < a)) continue;
    add(low, radius);
    low = radius;
    rooted = true;
  }
  detail::graded(
      low, a, is_tangent<P>() ? std::max(profile.end() - a, 0.0) : std::numeric_limits<double>::max(), add);
  return sum;
}

/// Contact pressure over reduced modulus at radius r of a contact with depth h and radius a, from Galin's
/// form by parts: p = [(h - g(r)) / sqrt(a^2 - r^2) + integral of (g(s) - g(r)) s / (s^2 - r^2)^(3/2)] / pi.
/// Zero outside; infinite at an edge that is fixed and under an apex that is sharp. To 1e-8, for pictures.
template <class P>
double pressure(const P& profile, double h, double a, double r) noexcept {
  if (r > a) return 0.0;
  const bool sharp = profile.slope(0.0) > 0.0;
  if (r == 0.0 && sharp) return std::numeric_limits<double>::infinity();
  if (r == a) return h > depth(profile, a) * (1.0 + 1e-9) ? std::numeric_limits<double>::infinity() : 0.0;
  r = std::max(r, 1e-9 * a);
  const double here = depth(profile, r), whole = std::acosh(a / r);
  // s = r cosh(w)
  const auto rise = [&](double w) {
    const double steep = std::sinh(w);
    return (depth(profile, r * std::cosh(w)) - here) * std::cosh(w) / (r * steep * steep);
  };
  double sum = 0.0, low = 0.0;
  bool rooted = false;
  const auto add = [&](double from, double to) {
    const int parts = static_cast<int>(std::ceil(to - from));
    for (int i = 0; i < parts; ++i, rooted = false)
      sum += detail::integral(from + (to - from) * i / parts, from + (to - from) * (i + 1) / parts, rooted,
                              rise);
  };
  for (const double radius : profile.breaks()) {
    if (!(radius > r && radius < a)) continue;
    const double high = std::acosh(radius / r);
    add(low, high);
    low = high;
    rooted = true;
  }
  detail::graded(low, whole, is_tangent<P>() ? std::max(profile.end() / a - 1.0, 0.0) : 1e9, add);
  return (sum + (h - here) / std::sqrt((a - r) * (a + r))) / std::numbers::pi;
}

}  // namespace sneddon
}  // namespace needleforce
