#include "objects/figure.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace vcharge {

namespace {

constexpr float kThigh_m = 0.44F;
constexpr float kShin_m = 0.43F;
constexpr float kAnkle_m = 0.07F;
constexpr double kHipSwing_rad = 0.45;
constexpr double kKneeBend_rad = 0.9;
constexpr int kSides = 12;

// End of a limb that hangs from `from`, rotated forwards by an angle.
Eigen::Vector3f hang(const Eigen::Vector3f& from, double forwards_rad, float length_m) {
  return from + length_m * Eigen::Vector3f(static_cast<float>(std::sin(forwards_rad)), 0.0F,
                                           -static_cast<float>(std::cos(forwards_rad)));
}

// Adds frustums through (height, radius), scaled by `depth` from front to back.
void addRounded(const std::vector<Eigen::Vector2f>& profile, const Eigen::Vector3f& foot, float depth,
                uint32_t material, TriangleMesh* mesh) {
  const size_t first = mesh->vertices.size();
  for (size_t i = 0; i + 1 < profile.size(); ++i) {
    addFrustum(foot + Eigen::Vector3f(0.0F, 0.0F, profile[i].x()),
               foot + Eigen::Vector3f(0.0F, 0.0F, profile[i + 1].x()), profile[i].y(), profile[i + 1].y(),
               kSides, true, material, mesh);
  }
  for (size_t i = first; i < mesh->vertices.size(); ++i) {
    float& x = mesh->vertices[i].position.x();
    x = foot.x() + depth * (x - foot.x());
  }
}

struct Leg {
  double hip_rad, knee_rad;
  float length() const {
    return static_cast<float>(kThigh_m * std::cos(hip_rad) + kShin_m * std::cos(hip_rad - knee_rad)) +
           kAnkle_m;
  }
};

Leg legAt(double swing, double phase_rad) {
  return {swing * kHipSwing_rad * std::sin(phase_rad),
          swing * kKneeBend_rad * std::max(0.0, std::cos(phase_rad)) + 0.05};
}

}  // namespace

TriangleMesh makeFigure(const FigureMaterials& materials, double swing, double phase_rad) {
  TriangleMesh mesh;
  const Leg left = legAt(swing, phase_rad);
  const Leg right = legAt(swing, phase_rad + 3.14159265358979323846);
  // The longer leg stands on the ground.
  const float hip = std::max(left.length(), right.length());
  for (const float side : {1.0F, -1.0F}) {
    const Leg& leg = side > 0.0F ? left : right;
    const Eigen::Vector3f joint(0.0F, 0.1F * side, hip);
    const Eigen::Vector3f knee = hang(joint, leg.hip_rad, kThigh_m);
    const Eigen::Vector3f ankle = hang(knee, leg.hip_rad - leg.knee_rad, kShin_m);
    addFrustum(knee, joint, 0.065F, 0.095F, kSides, true, materials.trousers, &mesh);
    addFrustum(ankle, knee, 0.05F, 0.068F, kSides, true, materials.trousers, &mesh);
    addBox(placement(ankle.x() + 0.06, ankle.y(), ankle.z() - 0.02, 0.0), {0.27F, 0.1F, 0.1F},
           materials.shoes, &mesh);
    const Eigen::Vector3f shoulder(0.0F, 0.215F * side, hip + 0.52F);
    const double arm_rad = -leg.hip_rad;
    const Eigen::Vector3f elbow = hang(shoulder, arm_rad, 0.3F);
    const Eigen::Vector3f wrist = hang(elbow, arm_rad + 0.35, 0.26F);
    addFrustum(elbow, shoulder, 0.045F, 0.06F, kSides, true, materials.jacket, &mesh);
    addFrustum(wrist, elbow, 0.035F, 0.046F, kSides, true, materials.jacket, &mesh);
    addFrustum(hang(wrist, arm_rad + 0.35, 0.15F), wrist, 0.025F, 0.038F, kSides, true, materials.skin,
               &mesh);
  }
  const Eigen::Vector3f pelvis(0.0F, 0.0F, hip);
  addRounded({{-0.08F, 0.16F}, {0.1F, 0.175F}, {0.3F, 0.17F}, {0.5F, 0.21F}, {0.57F, 0.1F}}, pelvis, 0.62F,
             materials.jacket, &mesh);
  addRounded({{0.56F, 0.06F}, {0.64F, 0.055F}}, pelvis, 1.0F, materials.skin, &mesh);
  addRounded({{0.61F, 0.05F}, {0.67F, 0.085F}, {0.74F, 0.095F}, {0.8F, 0.085F}, {0.84F, 0.03F}}, pelvis,
             1.15F, materials.skin, &mesh);
  return mesh;
}

}  // namespace vcharge
