#include "points/rotation_correction.h"

#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

/// Equations of points with a rotation, of which a fraction moves.
std::vector<RotationEquation> makeEquations(const Eigen::Vector3d& rotation, double moving_fraction) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  std::vector<RotationEquation> equations;
  for (int i = 0; i < 300; ++i) {
    RotationEquation equation;
    for (int entry = 0; entry < 6; ++entry) {
      equation.by_rotation(entry / 3, entry % 3) = 0.5 * normal(random);
    }
    equation.has_second = i % 2 == 0;
    equation.sigma_rad = 0.002;
    const bool moves = uniform(random) < moving_fraction;
    equation.residual_rad = equation.by_rotation * rotation +
                            0.002 * Eigen::Vector2d(normal(random), normal(random)) +
                            (moves ? Eigen::Vector2d(0.05, 0.03) : Eigen::Vector2d(0.0, 0.0));
    equations.push_back(equation);
  }
  return equations;
}

TEST(RotationCorrectionTest, FindsTheRotationAmongMovingPoints) {
  const Eigen::Vector3d rotation(0.002, -0.008, 0.003);
  EXPECT_LT((correctRotation(makeEquations(rotation, 0.3), 0.01) - rotation).norm(), 0.001);
}

TEST(RotationCorrectionTest, IsZeroWithoutEquations) {
  EXPECT_EQ(correctRotation({}, 0.004), Eigen::Vector3d::Zero());
}

}  // namespace
}  // namespace vcharge
