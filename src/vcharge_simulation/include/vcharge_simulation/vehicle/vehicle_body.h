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
  /// A glossy body reflects the scene itself, and its outline is out of focus.
  VehicleBody(TriangleMesh mesh, std::vector<Material> materials, bool is_glossy = false);
  ~VehicleBody();
  VehicleBody(const VehicleBody&) = delete;
  VehicleBody& operator=(const VehicleBody&) = delete;

  const TriangleMesh& mesh() const { return mesh_; }
  const std::vector<Material>& materials() const { return materials_; }
  bool isGlossy() const { return is_glossy_; }
  const RayTracer& tracer() const { return *tracer_; }
  /// Radius about the vehicle origin that contains the whole body.
  float radius() const { return radius_m_; }

 private:
  TriangleMesh mesh_;
  std::vector<Material> materials_;
  const bool is_glossy_;
  std::unique_ptr<RayTracer> tracer_;
  float radius_m_ = 0.0F;
};

}  // namespace vcharge
