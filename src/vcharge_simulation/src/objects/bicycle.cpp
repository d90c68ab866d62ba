#include "objects/bicycle.h"

#include <algorithm>
#include <cmath>

namespace vcharge {

namespace {

constexpr float kPi = 3.14159265F;
constexpr float kWheelRadius_m = 0.34F;
constexpr float kAxle_m = 0.53F;  // distance of both axles from the middle
constexpr float kCrank_m = 0.17F;
constexpr float kThigh_m = 0.44F;
constexpr float kShin_m = 0.46F;
constexpr int kSides = 8;
const Eigen::Vector3f kBottomBracket(-0.1F, 0.0F, 0.3F);
const Eigen::Vector3f kSaddle(-0.27F, 0.0F, 0.93F);
const Eigen::Vector3f kHead(0.36F, 0.0F, 0.88F);  // upper end of the fork
const Eigen::Vector3f kBar(0.33F, 0.0F, 1.0F);

void addTube(const Eigen::Vector3f& from, const Eigen::Vector3f& to, float radius_m, uint32_t material,
             TriangleMesh* mesh) {
  addFrustum(from, to, radius_m, radius_m, kSides, true, material, mesh);
}

void addWheel(float x, const BicycleMaterials& materials, TriangleMesh* mesh) {
  constexpr int kPieces = 20;
  const Eigen::Vector3f hub(x, 0.0F, kWheelRadius_m);
  const auto rim = [&](int i) {
    const float angle = 2.0F * kPi * static_cast<float>(i) / kPieces;
    return (hub + (kWheelRadius_m - 0.02F) * Eigen::Vector3f(std::cos(angle), 0.0F, std::sin(angle))).eval();
  };
  for (int i = 0; i < kPieces; ++i) {
    addFrustum(rim(i), rim(i + 1), 0.02F, 0.02F, 6, false, materials.tyre, mesh);
    if (i % 4 == 0) {
      addFrustum(hub, rim(i), 0.004F, 0.004F, 4, false, materials.frame, mesh);
    }
  }
}

// Knee between hip and ankle, bent forwards.
Eigen::Vector3f kneeBetween(const Eigen::Vector3f& hip, const Eigen::Vector3f& ankle) {
  const Eigen::Vector3f down = ankle - hip;
  const float length_m = std::min(down.norm(), kThigh_m + kShin_m - 1e-3F);
  const float along_m = (length_m * length_m + kThigh_m * kThigh_m - kShin_m * kShin_m) / (2.0F * length_m);
  const float aside_m = std::sqrt(std::max(0.0F, kThigh_m * kThigh_m - along_m * along_m));
  const Eigen::Vector3f direction = down.normalized();
  const Eigen::Vector3f forwards = Eigen::Vector3f::UnitY().cross(direction) * -1.0F;
  return hip + along_m * direction + aside_m * forwards;
}

}  // namespace

TriangleMesh makeBicycle(const BicycleMaterials& bicycle, const FigureMaterials& rider, double crank_rad) {
  TriangleMesh mesh;
  const Eigen::Vector3f rear(-kAxle_m, 0.0F, kWheelRadius_m);
  const Eigen::Vector3f front(kAxle_m, 0.0F, kWheelRadius_m);
  addWheel(rear.x(), bicycle, &mesh);
  addWheel(front.x(), bicycle, &mesh);
  addTube(rear, kBottomBracket, 0.012F, bicycle.frame, &mesh);
  addTube(rear, kSaddle - Eigen::Vector3f(0.0F, 0.0F, 0.2F), 0.01F, bicycle.frame, &mesh);
  addTube(kBottomBracket, kSaddle, 0.017F, bicycle.frame, &mesh);
  addTube(kBottomBracket, kHead - Eigen::Vector3f(-0.03F, 0.0F, 0.15F), 0.02F, bicycle.frame, &mesh);
  addTube(kSaddle - Eigen::Vector3f(0.0F, 0.0F, 0.12F), kHead, 0.017F, bicycle.frame, &mesh);
  addTube(front, kHead, 0.015F, bicycle.frame, &mesh);
  addTube(kHead, kBar, 0.015F, bicycle.frame, &mesh);
  addTube(kBar - Eigen::Vector3f(0.0F, 0.29F, 0.0F), kBar + Eigen::Vector3f(0.0F, 0.29F, 0.0F), 0.014F,
          bicycle.frame, &mesh);
  addBox(placement(kSaddle.x(), 0.0, kSaddle.z() + 0.02, 0.0), {0.26F, 0.13F, 0.05F}, bicycle.saddle, &mesh);

  const Eigen::Vector3f pelvis = kSaddle + Eigen::Vector3f(0.0F, 0.0F, 0.1F);
  const Eigen::Vector3f chest = pelvis + Eigen::Vector3f(0.24F, 0.0F, 0.42F);
  for (const float side : {1.0F, -1.0F}) {
    const auto angle = static_cast<float>(crank_rad) + (side > 0.0F ? 0.0F : kPi);
    const Eigen::Vector3f aside(0.0F, 0.1F * side, 0.0F);
    const Eigen::Vector3f pedal =
        kBottomBracket + aside + kCrank_m * Eigen::Vector3f(std::sin(angle), 0.0F, std::cos(angle));
    const Eigen::Vector3f ankle = pedal + Eigen::Vector3f(-0.08F, 0.0F, 0.08F);
    const Eigen::Vector3f hip = pelvis + aside;
    const Eigen::Vector3f knee = kneeBetween(hip, ankle);
    addFrustum(knee, hip, 0.06F, 0.09F, kSides, true, rider.trousers, &mesh);
    addFrustum(ankle, knee, 0.045F, 0.062F, kSides, true, rider.trousers, &mesh);
    addBox(placement(pedal.x(), pedal.y(), pedal.z() + 0.04, 0.0), {0.27F, 0.1F, 0.09F}, rider.shoes, &mesh);
    const Eigen::Vector3f shoulder = chest + Eigen::Vector3f(0.0F, 0.2F * side, -0.02F);
    const Eigen::Vector3f hand = kBar + Eigen::Vector3f(0.0F, 0.25F * side, 0.02F);
    const Eigen::Vector3f elbow = 0.5F * (shoulder + hand) + Eigen::Vector3f(-0.05F, 0.05F * side, -0.06F);
    addFrustum(elbow, shoulder, 0.043F, 0.058F, kSides, true, rider.jacket, &mesh);
    addFrustum(hand, elbow, 0.033F, 0.043F, kSides, true, rider.jacket, &mesh);
  }
  addFrustum(pelvis - Eigen::Vector3f(0.02F, 0.0F, 0.05F), chest, 0.15F, 0.19F, 12, true, rider.jacket,
             &mesh);
  addFrustum(chest, chest + Eigen::Vector3f(0.04F, 0.0F, 0.08F), 0.19F, 0.09F, 12, true, rider.jacket, &mesh);
  // The head sits where that of an upright figure with its pelvis under the chest would be.
  addFigureHead(rider, FigureShape(), chest + Eigen::Vector3f(0.06F, 0.0F, -0.5F), &mesh);
  return mesh;
}

}  // namespace vcharge
