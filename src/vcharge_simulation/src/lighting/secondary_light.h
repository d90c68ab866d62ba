#pragma once

#include "rendering/exposed_rows.h"
#include "rendering/surface_shader.h"
#include "vcharge_simulation/sensors/camera_view.h"

namespace vcharge {

inline constexpr float kMaxShadow_m = 150.0F;
/// Offset of the origins of shadow and mirrored rays from their surface.
inline constexpr float kShadowOffset_m = 0.01F;

/// Light that reaches the camera by more than one ray: shadows of the own car and of movers, the own car's
/// lamps, reflections in its paint and in wet ground. Immutable, thread safe.
class SecondaryLight {
 public:
  /// All arguments must outlive this object.
  SecondaryLight(const Scene& scene, const SurfaceShader& shader, const CameraView& view);

  bool hasSun() const { return has_sun_; }
  bool hasVehicleLamps() const { return has_vehicle_lamps_; }

  /// Shadows that no light map contains: those of the own car and of movers.
  bool isShadowed(const ExposedRow& row, const Eigen::Vector3f& position) const;
  /// Irradiance vector of the own car's lamps: times the normal of a surface it gives the irradiance.
  Eigen::Vector3f vehicleLampsAt(const ExposedRow& row, const Eigen::Vector3f& position) const;
  /// Light of a point on the own car. `ray` is the unit direction from the camera.
  float shadeBody(const ExposedRow& row, const CameraView::BodySample& sample,
                  const Eigen::Vector3f& ray) const;
  /// Light of ground under water. `dry` is the light of the dry ground, `normal` its unit normal up or down,
  /// `direction` and `footprint_m` belong to the ray from the camera.
  float wetted(const ExposedRow& row, float dry, float wetness, const Eigen::Vector3f& position,
               const Eigen::Vector3f& normal, const Eigen::Vector3f& direction, float footprint_m) const;

 private:
  bool isShadowedByBody(const ExposedRow& row, const Eigen::Vector3f& position) const;
  float mirroredLight(const ExposedRow& row, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                      float brightest, float cone_rad) const;
  bool meetsBody(const ExposedRow& row, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                 float* light) const;

  const Scene& scene_;
  const SurfaceShader& shader_;
  const CameraView& view_;
  const Eigen::Vector3f sun_;
  const bool has_sun_, has_vehicle_lamps_;
  const float faintest_lamp_;
};

}  // namespace vcharge
