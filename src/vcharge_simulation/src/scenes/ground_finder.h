#pragma once

#include <cstdint>
#include <vector>

#include "rendering/exposed_rows.h"
#include "rendering/surface_shader.h"
#include "vcharge_simulation/sensors/camera_view.h"

namespace vcharge {

/// Finds the blocks of an image that show only one plane of the ground, so that their samples need not be
/// traced individually. One ray per block is traced; a block is plain if it and all its neighbours meet the
/// same ground material in one plane. Only objects narrower than the distance between two rays could be
/// missed, so blocks whose rays land more than kMaxSpacing_m apart are never plain.
class GroundFinder {
 public:
  /// All arguments must outlive this object.
  GroundFinder(const ExposedRows& rows, const SurfaceShader& shader, const CameraView& view);

  static constexpr float kMaxSpacing_m = 0.03F;

  /// Plane normal.dot(point) = offset, with the unit normal of the triangle.
  struct Plane {
    Eigen::Vector3f normal;
    float offset;
    uint32_t triangle;
  };
  /// Plane seen by a plain block, null for other blocks.
  const Plane* planeOf(size_t block) const { return plain_[block] != 0 ? &planes_[block] : nullptr; }

 private:
  struct Probe {
    Eigen::Vector3f point;
    uint32_t material;
  };
  void probeRow(int block_y);
  void findPlainRow(int block_y);

  const ExposedRows& rows_;
  const SurfaceShader& shader_;
  const CameraView& view_;
  std::vector<Probe> probes_;
  std::vector<Plane> planes_;
  std::vector<uint8_t> plain_;
};

}  // namespace vcharge
