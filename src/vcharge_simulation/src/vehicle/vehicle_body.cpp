#include "vcharge_simulation/vehicle/vehicle_body.h"

#include <algorithm>
#include <utility>

#include "rendering/ray_tracer.h"

namespace vcharge {

VehicleBody::VehicleBody(TriangleMesh mesh, std::vector<Material> materials, bool is_glossy)
    : mesh_(std::move(mesh)),
      materials_(std::move(materials)),
      is_glossy_(is_glossy),
      tracer_(std::make_unique<RayTracer>(mesh_)) {
  for (const MeshVertex& vertex : mesh_.vertices) {
    radius_m_ = std::max(radius_m_, vertex.position.norm());
  }
}

VehicleBody::~VehicleBody() = default;

}  // namespace vcharge
