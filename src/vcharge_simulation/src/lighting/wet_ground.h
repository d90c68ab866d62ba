#pragma once

#include <Eigen/Core>

namespace vcharge {

/// Fraction of unpolarized light that smooth water reflects at this cosine of the angle of incidence
/// (Fresnel).
float waterReflectance(float cosine);

/// Water at a point of the ground.
struct Water {
  float darkening;         ///< factor on the reflectance of the ground under the water
  float mirror;            ///< fraction of the surface that is smooth
  Eigen::Vector3f normal;  ///< unit, of the water's surface
};

/// Puddles lie where low-frequency noise is high and the ground level; elsewhere a film covers part of the
/// grains. `wetness` from 0 to 1; `footprint_m` smooths ripples that a pixel does not resolve.
Water waterAt(const Eigen::Vector3f& position, const Eigen::Vector3f& ground_normal, float wetness,
              float footprint_m);

}  // namespace vcharge
