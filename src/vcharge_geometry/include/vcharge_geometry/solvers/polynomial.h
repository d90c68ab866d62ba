#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "vcharge_geometry/solvers/fixed_vector.h"

namespace vcharge {

/// c[0] + c[1] x + ... + c[Degree] x^Degree. As a form in two variables (y, x): c[0] y^Degree + c[1]
/// y^(Degree-1) x + ... + c[Degree] x^Degree.
template <int Degree>
using Polynomial = std::array<double, static_cast<size_t>(Degree) + 1>;

template <size_t A, size_t B>
std::array<double, A + B - 1> multiply(const std::array<double, A>& a, const std::array<double, B>& b) {
  std::array<double, A + B - 1> product{};
  for (size_t i = 0; i < A; ++i) {
    for (size_t j = 0; j < B; ++j) {
      product[i + j] += a[i] * b[j];
    }
  }
  return product;
}

/// *sum += factor * term, where the term may have a lower degree.
template <size_t A, size_t B>
void addScaled(const std::array<double, B>& term, double factor, std::array<double, A>* sum) {
  static_assert(B <= A, "the sum must hold the term");
  for (size_t i = 0; i < B; ++i) {
    (*sum)[i] += factor * term[i];
  }
}

template <size_t N>
double evaluate(const std::array<double, N>& polynomial, double x) {
  double value = polynomial[N - 1];
  for (size_t i = N - 1; i-- > 0;) {
    value = value * x + polynomial[i];
  }
  return value;
}

template <size_t N>
void evaluateWithDerivative(const std::array<double, N>& polynomial, double x, double* value,
                            double* derivative) {
  double p = polynomial[N - 1];
  double d = 0.0;
  for (size_t i = N - 1; i-- > 0;) {
    d = d * x + p;
    p = p * x + polynomial[i];
  }
  *value = p;
  *derivative = d;
}

template <size_t N>
double largestMagnitude(const std::array<double, N>& polynomial) {
  double largest = 0.0;
  for (const double coefficient : polynomial) {
    largest = std::max(largest, std::abs(coefficient));
  }
  return largest;
}

/// True if all coefficients are finite.
template <size_t N>
bool allFinite(const std::array<double, N>& polynomial) {
  double sum = 0.0;
  for (const double coefficient : polynomial) {
    sum += std::abs(coefficient);
  }
  return std::isfinite(sum);
}

namespace internal {

/// Newton's method in the bracket [low, high], at whose ends the signs of the polynomial differ; bisects when
/// a step leaves the bracket.
template <size_t N>
double rootInBracket(const std::array<double, N>& polynomial, double low, double high, bool low_is_negative,
                     double start) {
  double x = start;
  for (int iteration = 0; iteration < 60; ++iteration) {
    double value = 0.0;
    double derivative = 0.0;
    evaluateWithDerivative(polynomial, x, &value, &derivative);
    if ((value < 0.0) == low_is_negative) {
      low = x;
    } else {
      high = x;
    }
    double next = x - value / derivative;
    // The condition is also false for NaN, where the derivative vanishes.
    if (!(next >= low && next <= high)) {
      next = 0.5 * (low + high);
    }
    const double step = std::abs(next - x);
    x = next;
    // Newton's method converges quadratically: one more step reaches rounding precision.
    if (step <= 1e-9 * std::abs(x) || value == 0.0) {
      evaluateWithDerivative(polynomial, x, &value, &derivative);
      const double last = x - value / derivative;
      return last >= low && last <= high ? last : x;
    }
  }
  return x;
}

/// An extremum near x, by Newton's method on the derivative.
template <size_t N>
double extremumFrom(const std::array<double, N>& polynomial, double x) {
  std::array<double, N - 1> derivative;
  for (size_t i = 1; i < N; ++i) {
    derivative[i - 1] = static_cast<double>(i) * polynomial[i];
  }
  for (int iteration = 0; iteration < 6; ++iteration) {
    double slope = 0.0;
    double curvature = 0.0;
    evaluateWithDerivative(derivative, x, &slope, &curvature);
    x -= slope / curvature;
  }
  return x;
}

/// A part of the unit interval with the polynomial's Bernstein coefficients on it.
template <size_t N>
struct BernsteinPiece {
  std::array<double, N> coefficients;
  double low;
  double width;
  int depth;
};

template <size_t N>
void splitInHalf(const BernsteinPiece<N>& piece, BernsteinPiece<N>* left, BernsteinPiece<N>* right) {
  std::array<double, N> row = piece.coefficients;
  for (size_t level = 0; level < N; ++level) {
    left->coefficients[level] = row[0];
    right->coefficients[N - 1 - level] = row[N - 1 - level];
    for (size_t i = 0; i + 1 < N - level; ++i) {
      row[i] = 0.5 * (row[i] + row[i + 1]);
    }
  }
  left->low = piece.low;
  left->width = right->width = 0.5 * piece.width;
  right->low = piece.low + left->width;
  left->depth = right->depth = piece.depth + 1;
}

constexpr double binomial(size_t n, size_t k) {
  double value = 1.0;
  for (size_t i = 0; i < k; ++i) {
    value = value * static_cast<double>(n - i) / static_cast<double>(i + 1);
  }
  return value;
}

template <size_t N>
constexpr std::array<double, N> inverseBinomials() {
  std::array<double, N> inverse{};
  for (size_t k = 0; k < N; ++k) {
    inverse[k] = 1.0 / binomial(N - 1, k);
  }
  return inverse;
}

}  // namespace internal

/// Calls visit(x) for each real root in [0, 1]. Bisection isolates roots by the sign variations of Bernstein
/// coefficients (Lane and Riesenfeld, "Bounds on a polynomial", BIT 1981), which needs no division and
/// tolerates vanishing leading coefficients; Newton's method then refines each. Roots at 0, 1 or a dyadic
/// point may be reported twice. Two roots closer than about 1e-6, or a complex pair that close to the real
/// axis, are reported as one, since noise moves double roots off the axis.
template <size_t N, class Visitor>
void visitRootsInUnitInterval(const std::array<double, N>& polynomial, const Visitor& visit) {
  constexpr int kMaxDepth = 20;
  constexpr int kDoubleRootDepth = 10;
  static constexpr std::array<double, N> kInverseBinomials = internal::inverseBinomials<N>();
  std::array<internal::BernsteinPiece<N>, kMaxDepth + 2> stack;
  internal::BernsteinPiece<N>& whole = stack[0];
  for (size_t i = 0; i < N; ++i) {
    whole.coefficients[i] = polynomial[i] * kInverseBinomials[i];
  }
  for (size_t level = 1; level < N; ++level) {
    for (size_t i = N - 1; i >= level; --i) {
      whole.coefficients[i] += whole.coefficients[i - 1];
    }
  }
  whole.low = 0.0;
  whole.width = 1.0;
  whole.depth = 0;
  const double zero = 1e-15 * static_cast<double>(N) * largestMagnitude(polynomial);
  double end_of_run = -1.0;
  int top = 0;
  while (top >= 0) {
    const internal::BernsteinPiece<N> piece = stack[static_cast<size_t>(top--)];
    const std::array<double, N>& b = piece.coefficients;
    size_t first = 0;
    size_t last = N - 1;
    if (std::abs(b[0]) <= zero) {
      visit(piece.low);
      first = 1;
    }
    if (std::abs(b[N - 1]) <= zero) {
      visit(piece.low + piece.width);
      last = N - 2;
    }
    int variations = 0;
    size_t crossing = 0;
    for (size_t i = first; i < last; ++i) {
      if ((b[i] < 0.0) != (b[i + 1] < 0.0)) {
        ++variations;
        crossing = i;
      }
    }
    if (variations == 0) {
      continue;
    }
    if (variations == 1 && first == 0 && last == N - 1) {
      const double fraction = b[crossing] / (b[crossing] - b[crossing + 1]);
      const double start =
          piece.low + piece.width * (static_cast<double>(crossing) + fraction) / static_cast<double>(N - 1);
      visit(internal::rootInBracket(polynomial, piece.low, piece.low + piece.width, b[0] < 0.0, start));
      continue;
    }
    if (piece.depth >= kDoubleRootDepth) {
      const double extremum = internal::extremumFrom(polynomial, piece.low + 0.5 * piece.width);
      if (std::abs(extremum - piece.low - 0.5 * piece.width) <= 0.5 * piece.width) {
        const double value = evaluate(polynomial, extremum);
        const bool negative = b[0] < 0.0;
        if (variations == 2 && first == 0 && last == N - 1 && (value < 0.0) != negative) {
          visit(internal::rootInBracket(polynomial, piece.low, extremum, negative, extremum));
          visit(internal::rootInBracket(polynomial, extremum, piece.low + piece.width, !negative, extremum));
          continue;
        }
        if (std::abs(value) <= 100.0 * zero) {
          if (piece.low - end_of_run > 4.0 * piece.width) {
            visit(extremum);
          }
          end_of_run = piece.low + piece.width;
          continue;
        }
      }
    }
    if (piece.depth == kMaxDepth) {
      // Pieces are visited from left to right; a sequence of them is one root, blurred by rounding.
      if (piece.low - end_of_run > 4.0 * piece.width) {
        visit(piece.low + 0.5 * piece.width);
      }
      end_of_run = piece.low + piece.width;
      continue;
    }
    top += 2;
    internal::splitInHalf(piece, &stack[static_cast<size_t>(top)], &stack[static_cast<size_t>(top) - 1]);
  }
}

/// Positive real roots, each once, in no particular order. Best conditioned if they are near 1.
template <size_t N>
FixedVector<double, static_cast<int>(N) - 1> positiveRealRoots(const std::array<double, N>& polynomial) {
  FixedVector<double, static_cast<int>(N) - 1> roots;
  const auto add = [&roots](double root) {
    for (const double other : roots) {
      if (std::abs(root - other) <= 1e-12 * (root + other)) {
        return;
      }
    }
    roots.push_back(root);
  };
  std::array<double, N> reversed;
  std::reverse_copy(polynomial.begin(), polynomial.end(), reversed.begin());
  visitRootsInUnitInterval(polynomial, [&](double x) {
    if (x > 0.0) {
      add(x);
    }
  });
  visitRootsInUnitInterval(reversed, [&](double x) {
    if (x > 0.0) {
      add(1.0 / x);
    }
  });
  return roots;
}

/// Real roots of a x^2 + b x + c without cancellation; a double root is returned once.
inline FixedVector<double, 2> quadraticRoots(double a, double b, double c) {
  FixedVector<double, 2> roots;
  const double half = -0.5 * b;
  const double discriminant = half * half - a * c;
  // Accepts a double root that became complex by rounding.
  if (discriminant < -1e-14 * half * half || (a == 0.0 && b == 0.0)) {
    return roots;
  }
  const double q = half + std::copysign(std::sqrt(std::max(0.0, discriminant)), half);
  if (q == 0.0) {
    roots.push_back(0.0);
    return roots;
  }
  roots.push_back(c / q);
  if (a != 0.0 && discriminant > 0.0) {
    roots.push_back(q / a);
  }
  return roots;
}

}  // namespace vcharge
