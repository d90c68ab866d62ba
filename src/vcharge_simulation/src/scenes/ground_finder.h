#pragma once

#include <cstdint>
#include <vector>

#include "rendering/surface_shader.h"
#include "scenes/scene_instant.h"
#include "vcharge_simulation/sensors/camera_view.h"

namespace vcharge {

/// Finds the blocks of an image that see nothing but one plane of the ground, so that their samples need no
/// ray each: one ray is traced per block, and a block is plain when it and all its neighbours meet the same
/// ground material in one plane. Something on the ground can hide from that only if it is narrower than the
/// distance between two blocks; so blocks whose rays land more than kMaxSpacing_m apart are never plain.
class GroundFinder {
 public:
  GroundFinder(const SceneInstant& instant, const SurfaceShader& shader, const CameraView& view,
               const Eigen::Matrix3f& world_from_camera, const Eigen::Vector3f& origin);

  static constexpr float kMaxSpacing_m = 0.03F;

  /// Plane n.x = offset with n along the triangle's normal (not unit).
  struct Plane {
    Eigen::Vector3f normal;
    float offset;
    uint32_t triangle;
  };
  /// Null where the block sees anything else or may do so.
  const Plane* planeOf(size_t block) const { return plain_[block] != 0 ? &planes_[block] : nullptr; }

 private:
  struct Probe {
    Eigen::Vector3f point;
    uint32_t material;
  };
  void probeRow(int block_y);
  void findPlainRow(int block_y);

  const SceneInstant& instant_;
  const SurfaceShader& shader_;
  const CameraView& view_;
  const Eigen::Matrix3f rotation_;
  const Eigen::Vector3f origin_;
  std::vector<Probe> probes_;
  std::vector<Plane> planes_;
  std::vector<uint8_t> plain_;
};

}  // namespace vcharge
