#include "rendering/exposed_rows.h"

#include <algorithm>
#include <cmath>

namespace vcharge {

ExposedRows::ExposedRows(const Scene& scene, const RayTracer& tracer, const CameraView& view,
                         const Readout& readout, double time_s) {
  const bool rolls = readout.readout_time_s > 0.0;
  const size_t num_instants = rolls && !scene.movers.empty()
                                  ? static_cast<size_t>(std::ceil(readout.readout_time_s / kMoverStep_s))
                                  : 1;
  for (size_t i = 0; i < num_instants; ++i) {
    const double fraction = (static_cast<double>(i) + 0.5) / static_cast<double>(num_instants);
    instants_.push_back(
        std::make_unique<const SceneInstant>(scene, tracer, time_s + readout.timeAt(fraction)));
  }
  const size_t num_rows = rolls ? static_cast<size_t>(view.blockRows()) : 1;
  rows_.reserve(num_rows);
  for (size_t i = 0; i < num_rows; ++i) {
    // A block has two rows; the last one may have only one.
    const double fraction = rolls ? std::min(1.0, static_cast<double>(2 * i + 1) / view.size().height) : 0.5;
    const RigidTransform world_from_vehicle = readout.motion.at(readout.timeAt(fraction));
    const RigidTransform world_from_camera = world_from_vehicle * *view.camera().vehicle_from_camera;
    ExposedRow row;
    const auto instant = static_cast<size_t>(fraction * static_cast<double>(num_instants));
    row.instant = instants_[std::min(instant, num_instants - 1)].get();
    row.vehicle_rotation = world_from_vehicle.rotationMatrix().cast<float>();
    row.vehicle_origin = world_from_vehicle.translation().cast<float>();
    row.rotation = world_from_camera.rotationMatrix().cast<float>();
    row.origin = world_from_camera.translation().cast<float>();
    row.sun_in_vehicle = row.vehicle_rotation.transpose() * scene.sky->directionToSun();
    rows_.push_back(row);
  }
}

}  // namespace vcharge
