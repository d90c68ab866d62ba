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
  float scale;
  double hip_rad, knee_rad;
  float length() const {
    return scale *
           (static_cast<float>(kThigh_m * std::cos(hip_rad) + kShin_m * std::cos(hip_rad - knee_rad)) +
            kAnkle_m);
  }
};

Leg legAt(float scale, double swing, double phase_rad) {
  return {scale, swing * kHipSwing_rad * std::sin(phase_rad),
          swing * kKneeBend_rad * std::max(0.0, std::cos(phase_rad)) + 0.05};
}

}  // namespace

double FigureShape::height() const {
  return (kThigh_m + kShin_m + kAnkle_m) * legs + 0.57 * trunk + 0.27 * head;
}

double FigureShape::radius() const {
  return kFigureRadius_m * std::max(legs, width);
}

double FigureShape::stride() const {
  return kFigureStride_m * legs;
}

Eigen::Vector3f hangLimb(const Eigen::Vector3f& from, double forwards_rad, float length_m) {
  return from + length_m * Eigen::Vector3f(static_cast<float>(std::sin(forwards_rad)), 0.0F,
                                           -static_cast<float>(std::cos(forwards_rad)));
}

void addFigureHead(const FigureMaterials& materials, const FigureShape& shape, const Eigen::Vector3f& pelvis,
                   TriangleMesh* mesh) {
  const float s = shape.head;
  const Eigen::Vector3f chin = pelvis + Eigen::Vector3f(0.0F, 0.0F, 0.57F * (shape.trunk - s));
  addRounded({{0.56F * s, 0.06F * s}, {0.64F * s, 0.055F * s}}, chin, 1.0F, materials.skin, mesh);
  addRounded({{0.61F * s, 0.05F * s},
              {0.67F * s, 0.085F * s},
              {0.74F * s, 0.095F * s},
              {0.8F * s, 0.085F * s},
              {0.84F * s, 0.03F * s}},
             chin, 1.15F, materials.skin, mesh);
}

TriangleMesh makeFigure(const FigureMaterials& materials, double swing, double phase_rad,
                        const FigureShape& shape) {
  TriangleMesh mesh;
  const float l = shape.legs;
  const float t = shape.trunk;
  const float w = shape.width;
  const Leg left = legAt(l, swing, phase_rad);
  const Leg right = legAt(l, swing, phase_rad + 3.14159265358979323846);
  // The longer leg stands on the ground.
  const float hip = std::max(left.length(), right.length());
  for (const float side : {1.0F, -1.0F}) {
    const Leg& leg = side > 0.0F ? left : right;
    const Eigen::Vector3f joint(0.0F, 0.1F * side * w, hip);
    const Eigen::Vector3f knee = hangLimb(joint, leg.hip_rad, kThigh_m * l);
    const Eigen::Vector3f ankle = hangLimb(knee, leg.hip_rad - leg.knee_rad, kShin_m * l);
    addFrustum(knee, joint, 0.065F * w, 0.095F * w, kSides, true, materials.trousers, &mesh);
    addFrustum(ankle, knee, 0.05F * w, 0.068F * w, kSides, true, materials.trousers, &mesh);
    addBox(placement(ankle.x() + 0.06 * l, ankle.y(), ankle.z() - 0.02 * l, 0.0),
           {0.27F * l, 0.1F * w, 0.1F * l}, materials.shoes, &mesh);
    const Eigen::Vector3f shoulder(0.0F, 0.215F * side * w, hip + 0.52F * t);
    const double arm_rad = -leg.hip_rad;
    const Eigen::Vector3f elbow = hangLimb(shoulder, arm_rad, 0.3F * t);
    const Eigen::Vector3f wrist = hangLimb(elbow, arm_rad + 0.35, 0.26F * t);
    addFrustum(elbow, shoulder, 0.045F * w, 0.06F * w, kSides, true, materials.jacket, &mesh);
    addFrustum(wrist, elbow, 0.035F * w, 0.046F * w, kSides, true, materials.jacket, &mesh);
    addFrustum(hangLimb(wrist, arm_rad + 0.35, 0.15F * t), wrist, 0.025F * w, 0.038F * w, kSides, true,
               materials.skin, &mesh);
  }
  const Eigen::Vector3f pelvis(0.0F, 0.0F, hip);
  addRounded({{-0.08F * t, 0.16F * w},
              {0.1F * t, 0.175F * w},
              {0.3F * t, 0.17F * w},
              {0.5F * t, 0.21F * w},
              {0.57F * t, 0.1F * w}},
             pelvis, 0.62F, materials.jacket, &mesh);
  addFigureHead(materials, shape, pelvis, &mesh);
  return mesh;
}

}  // namespace vcharge
