#pragma once

#include "vcharge_simulation/renderer.h"

namespace vcharge {

/// An image that a test takes.
struct Sighting {
  const CameraView& view;
  RigidTransform world_from_vehicle;
  double time_s = 0.0;
};

/// Mean absolute difference of gray between pixels of `first` and where the exact range puts them in
/// `second`: seen by both, at less than 75 degrees from the surface's normal and from the optical axis, where
/// `second` is no coarser than `first`, and not beside an outline.
struct Reprojection {
  double mean_difference = 0.0;
  int count = 0;
};
/// Cars mirror other surroundings into each camera; kNoCars leaves them out.
enum class Surfaces { kAll, kNoCars };
Reprojection reproject(const Renderer& renderer, const Sighting& first, const Sighting& second,
                       Surfaces surfaces = Surfaces::kAll);

}  // namespace vcharge
