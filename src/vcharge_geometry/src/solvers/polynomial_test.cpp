#include "vcharge_geometry/solvers/polynomial.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "vcharge_geometry/solvers/half_angle_roots.h"

namespace vcharge {
namespace {

template <int Degree>
Polynomial<Degree> fromRoots(const std::vector<double>& real_roots, double complex_real,
                             double complex_imag) {
  Polynomial<Degree> polynomial{};
  polynomial[0] = 1.0;
  int degree = 0;
  const auto multiplyBy = [&](double c0, double c1, double c2) {
    Polynomial<Degree> product{};
    for (int i = 0; i <= degree; ++i) {
      product[i] += c0 * polynomial[i];
      if (i + 1 <= Degree) {
        product[i + 1] += c1 * polynomial[i];
      }
      if (i + 2 <= Degree) {
        product[i + 2] += c2 * polynomial[i];
      }
    }
    polynomial = product;
  };
  for (const double root : real_roots) {
    multiplyBy(-root, 1.0, 0.0);
    ++degree;
  }
  while (degree < Degree) {
    // Avoids multiple pairs, which are close to being real.
    complex_imag += 0.3;
    multiplyBy(complex_real * complex_real + complex_imag * complex_imag, -2.0 * complex_real, 1.0);
    degree += 2;
  }
  return polynomial;
}

/// Checks that exactly the true roots are found, to 1e-6 (closer roots are ill conditioned in degree 8).
template <int Degree>
void findsRandomRoots(unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> angle(-0.5 * M_PI, 0.5 * M_PI);
  std::uniform_real_distribution<double> scale(-3.0, 3.0);
  int tested = 0;
  int missed = 0;
  while (tested < 10000) {
    const int num_real = Degree - 2 * static_cast<int>(generator() % (Degree / 2 + 1));
    std::vector<double> angles(static_cast<size_t>(num_real));
    for (double& value : angles) {
      value = angle(generator);
    }
    std::sort(angles.begin(), angles.end());
    // The projective line is closed: -90 and 90 degrees are the same point.
    bool distinct = angles.empty() || angles.back() - angles.front() < M_PI - 0.15;
    std::vector<double> roots;
    for (size_t i = 0; i < angles.size(); ++i) {
      distinct = distinct && (i == 0 || angles[i] - angles[i - 1] > 0.15);
      roots.push_back(std::tan(angles[i]));
    }
    if (!distinct) {
      continue;
    }
    ++tested;
    Polynomial<Degree> form = fromRoots<Degree>(roots, scale(generator), 0.1 + std::abs(scale(generator)));
    for (double& coefficient : form) {
      coefficient *= 1e-3;
    }
    const auto found = halfAngleRoots(form);
    std::vector<double> found_angles;
    for (const HalfAngle& root : found) {
      EXPECT_NEAR(root.cosine * root.cosine + root.sine * root.sine, 1.0, 1e-14);
      EXPECT_GE(root.cosine, 0.0);
      found_angles.push_back(std::atan2(root.sine, root.cosine));
    }
    std::sort(found_angles.begin(), found_angles.end());
    bool right = found_angles.size() == angles.size();
    for (size_t i = 0; right && i < angles.size(); ++i) {
      right = std::abs(found_angles[i] - angles[i]) < 1e-6;
    }
    missed += right ? 0 : 1;
  }
  EXPECT_EQ(missed, 0) << "degree " << Degree;
}

TEST(PolynomialTest, FindsAllRealRootsOfRandomForms) {
  findsRandomRoots<2>(2);
  findsRandomRoots<3>(3);
  findsRandomRoots<4>(4);
  findsRandomRoots<6>(6);
  findsRandomRoots<8>(8);
}

TEST(PolynomialTest, FindsRootsAtZeroOneAndInfinity) {
  // cosine * sine * (cosine - sine) * (cosine + sine): half angles 0, 90, 45, -45 degrees.
  const auto roots = halfAngleRoots(Polynomial<4>{0.0, 1.0, 0.0, -1.0, 0.0});
  ASSERT_EQ(roots.size(), 4);
  for (const HalfAngle& root : roots) {
    EXPECT_NEAR(root.cosine * root.sine * (root.cosine * root.cosine - root.sine * root.sine), 0.0, 1e-15);
  }
  EXPECT_EQ(halfAngleRoots(Polynomial<3>{0.0, 1.0, 1.0, 0.0}).size(), 3);
  EXPECT_EQ(halfAngleRoots(Polynomial<2>{0.0, 1.0, 0.0}).size(), 2);
  EXPECT_EQ(halfAngleRoots(Polynomial<2>{1.0, 0.0, 1.0}).size(), 0);
}

TEST(PolynomialTest, ReportsADoubleRootOnce) {
  // (x - 0.3)^2 (x^2 + 1), and (x - 0.3)^2 (x - 2)
  const auto quartic = halfAngleRoots(fromRoots<4>({0.3, 0.3}, 0.0, 1.0));
  ASSERT_EQ(quartic.size(), 1);
  EXPECT_NEAR(quartic[0].sine / quartic[0].cosine, 0.3, 2e-6);
  const auto cubic = halfAngleRoots(fromRoots<3>({0.3, 0.3, 2.0}, 0.0, 1.0));
  ASSERT_GE(cubic.size(), 2);
  for (const HalfAngle& root : cubic) {
    const double x = root.sine / root.cosine;
    EXPECT_LT(std::min(std::abs(x - 0.3), std::abs(x - 2.0)), 1e-6);
  }
}

TEST(PolynomialTest, FindsPositiveRootsOnly) {
  const Polynomial<4> polynomial = fromRoots<4>({-2.0, -0.5, 0.25, 40.0}, 0.0, 1.0);
  const auto roots = positiveRealRoots(polynomial);
  ASSERT_EQ(roots.size(), 2);
  EXPECT_NEAR(std::min(roots[0], roots[1]), 0.25, 1e-12);
  EXPECT_NEAR(std::max(roots[0], roots[1]), 40.0, 1e-9);
}

TEST(PolynomialTest, MultipliesAndEvaluates) {
  const Polynomial<1> a{1.0, 2.0};
  const Polynomial<2> b{3.0, 0.0, -1.0};
  Polynomial<3> product = multiply(a, b);
  EXPECT_EQ(product, (Polynomial<3>{3.0, 6.0, -1.0, -2.0}));
  addScaled(a, -3.0, &product);
  EXPECT_EQ(product, (Polynomial<3>{0.0, 0.0, -1.0, -2.0}));
  EXPECT_EQ(evaluate(product, 2.0), -20.0);
}

}  // namespace
}  // namespace vcharge
