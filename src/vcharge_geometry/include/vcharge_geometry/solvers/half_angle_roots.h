#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "vcharge_geometry/solvers/fixed_vector.h"
#include "vcharge_geometry/solvers/polynomial.h"

namespace vcharge {

/// A point of the projective line, cosine^2 + sine^2 = 1, cosine >= 0. Represents half of a yaw angle.
struct HalfAngle {
  double cosine;
  double sine;
};

namespace internal {

template <int Capacity>
void addHalfAngle(double cosine, double sine, FixedVector<HalfAngle, Capacity>* roots) {
  const double scale = std::copysign(1.0 / std::sqrt(cosine * cosine + sine * sine), cosine);
  const HalfAngle root{scale * cosine, scale * sine};
  for (const HalfAngle& other : *roots) {
    if (std::abs(root.sine * other.cosine - root.cosine * other.sine) <= 1e-12) {
      return;
    }
  }
  roots->push_back(root);
}

}  // namespace internal

/// Real roots on the projective line of the form sum_i c[i] cosine^(Degree-i) sine^i, each once, in no
/// particular order. An angle of pi (half-angle cosine 0) needs no special treatment.
template <size_t N>
FixedVector<HalfAngle, static_cast<int>(N) - 1> halfAngleRoots(const std::array<double, N>& form) {
  FixedVector<HalfAngle, static_cast<int>(N) - 1> roots;
  std::array<double, N> mirrored = form;
  for (size_t i = 1; i < N; i += 2) {
    mirrored[i] = -mirrored[i];
  }
  std::array<double, N> reversed;
  std::array<double, N> reversed_mirrored;
  std::reverse_copy(form.begin(), form.end(), reversed.begin());
  std::reverse_copy(mirrored.begin(), mirrored.end(), reversed_mirrored.begin());
  visitRootsInUnitInterval(form, [&](double x) { internal::addHalfAngle(1.0, x, &roots); });
  visitRootsInUnitInterval(mirrored, [&](double x) { internal::addHalfAngle(1.0, -x, &roots); });
  visitRootsInUnitInterval(reversed, [&](double x) { internal::addHalfAngle(x, 1.0, &roots); });
  visitRootsInUnitInterval(reversed_mirrored, [&](double x) { internal::addHalfAngle(x, -1.0, &roots); });
  return roots;
}

/// halfAngleRoots() of a form of degree 2, in closed form.
inline FixedVector<HalfAngle, 2> halfAngleRoots(const Polynomial<2>& form) {
  FixedVector<HalfAngle, 2> roots;
  const bool by_tangent = std::abs(form[2]) >= std::abs(form[0]);
  const double a = by_tangent ? form[2] : form[0];
  const double c = by_tangent ? form[0] : form[2];
  if (a == 0.0) {
    // c0 * cosine * sine
    internal::addHalfAngle(1.0, 0.0, &roots);
    internal::addHalfAngle(0.0, 1.0, &roots);
    return roots;
  }
  for (const double x : quadraticRoots(a, form[1], c)) {
    internal::addHalfAngle(by_tangent ? 1.0 : x, by_tangent ? x : 1.0, &roots);
  }
  return roots;
}

/// halfAngleRoots() of a form of degree 3: Newton's method from outside finds the root farthest from the
/// inflection, converging monotonically; a quadratic gives the others.
inline FixedVector<HalfAngle, 3> halfAngleRoots(const Polynomial<3>& form) {
  FixedVector<HalfAngle, 3> roots;
  const bool by_tangent = std::abs(form[3]) >= std::abs(form[0]);
  const auto add = [&](double x) {
    internal::addHalfAngle(by_tangent ? 1.0 : x, by_tangent ? x : 1.0, &roots);
  };
  const double leading = by_tangent ? form[3] : form[0];
  if (std::abs(leading) <= 1e-15 * std::max(std::abs(form[1]), std::abs(form[2]))) {
    // cosine * sine * (c1 cosine + c2 sine)
    internal::addHalfAngle(1.0, 0.0, &roots);
    internal::addHalfAngle(0.0, 1.0, &roots);
    internal::addHalfAngle(form[2], -form[1], &roots);
    return roots;
  }
  const double inverse = 1.0 / leading;
  const double c2 = inverse * (by_tangent ? form[2] : form[1]);
  const double c1 = inverse * (by_tangent ? form[1] : form[2]);
  const double c0 = inverse * (by_tangent ? form[0] : form[3]);
  const double inflection = -c2 / 3.0;
  const double value_there = ((inflection + c2) * inflection + c1) * inflection + c0;
  // Distance from the inflection to the extrema; the outer of three real roots is at most twice as far. A
  // single root is near the cube root of the value, or closer if the curve is steep.
  const double level_squared = inflection * inflection - c1 / 3.0;
  double distance = 0.0;
  if (value_there * value_there <= 4.0 * level_squared * level_squared * level_squared) {
    distance = 2.0 * std::sqrt(level_squared);
  } else if (level_squared > 0.0) {
    distance = std::cbrt(std::abs(value_there)) + std::sqrt(level_squared);
  } else {
    distance = std::min(std::cbrt(std::abs(value_there)), std::abs(value_there) / (-3.0 * level_squared));
  }
  double x = inflection - std::copysign(distance, value_there);
  for (int iteration = 0; iteration < 60; ++iteration) {
    const double slope = (3.0 * x + 2.0 * c2) * x + c1;
    const double value = ((x + c2) * x + c1) * x + c0;
    if (slope == 0.0) {
      break;
    }
    const double step = value / slope;
    x -= step;
    if (std::abs(step) <= 1e-9 * std::abs(x)) {
      break;
    }
  }
  const double slope = (3.0 * x + 2.0 * c2) * x + c1;
  if (slope != 0.0) {
    x -= (((x + c2) * x + c1) * x + c0) / slope;
  }
  add(x);
  const double b = x + c2;
  for (const double other : quadraticRoots(1.0, b, b * x + c1)) {
    add(other);
  }
  return roots;
}

}  // namespace vcharge
