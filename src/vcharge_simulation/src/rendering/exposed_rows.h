#pragma once

#include <memory>
#include <vector>

#include "rendering/ray_tracer.h"
#include "scenes/scene_instant.h"
#include "vcharge_simulation/sensors/camera_view.h"
#include "vcharge_simulation/sensors/readout.h"

namespace vcharge {

/// Camera, vehicle and movers while one row of blocks is exposed. Rotations and origins are in the world.
struct ExposedRow {
  const SceneInstant* instant;
  Eigen::Matrix3f vehicle_rotation, rotation;  ///< world_from_vehicle, world_from_camera
  Eigen::Vector3f vehicle_origin, origin;
  Eigen::Vector3f sun_in_vehicle;  ///< direction to the sun
};

/// The rows of blocks of an image, each at its time of the readout; a single one for a global shutter. Movers
/// move in steps of kMoverStep_s. Immutable, thread safe.
class ExposedRows {
 public:
  static constexpr double kMoverStep_s = 0.002;

  /// `time_s` is the scene time at the stamp; `scene` and its tracer must outlive this object.
  ExposedRows(const Scene& scene, const RayTracer& tracer, const CameraView& view, const Readout& readout,
              double time_s);

  const ExposedRow& operator[](int block_y) const {
    return rows_[rows_.size() == 1 ? 0 : static_cast<size_t>(block_y)];
  }
  /// Triangles of the movers while the middle row is exposed; they have the same numbers in all rows.
  const TriangleMesh& moving() const { return instants_[instants_.size() / 2]->moving(); }

 private:
  std::vector<std::unique_ptr<const SceneInstant>> instants_;
  std::vector<ExposedRow> rows_;
};

}  // namespace vcharge
