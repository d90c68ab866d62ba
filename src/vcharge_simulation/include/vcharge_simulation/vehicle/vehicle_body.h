#pragma once

#include <memory>
#include <vector>

#include "vcharge_simulation/rendering/mesh.h"
#include "vcharge_simulation/scenes/scene.h"

namespace vcharge {

class RayTracer;

/// Body of the car that carries the cameras, in the vehicle frame. It is visible to the cameras and casts a
/// shadow, but is not part of the scene.
class VehicleBody {
 public:
  VehicleBody(TriangleMesh mesh, std::vector<Material> materials);
  ~VehicleBody();
  VehicleBody(const VehicleBody&) = delete;
  VehicleBody& operator=(const VehicleBody&) = delete;

  const TriangleMesh& mesh() const { return mesh_; }
  const std::vector<Material>& materials() const { return materials_; }
  const RayTracer& tracer() const { return *tracer_; }
  /// Radius about the vehicle origin that contains the whole body.
  float radius() const { return radius_m_; }

 private:
  TriangleMesh mesh_;
  std::vector<Material> materials_;
  std::unique_ptr<RayTracer> tracer_;
  float radius_m_ = 0.0F;
};

}  // namespace vcharge
