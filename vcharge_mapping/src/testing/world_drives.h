#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "vcharge_core/sparse_map/sparse_map.h"

namespace vcharge::testing {

constexpr int kNumKeyframes = 160;

/// A map of everything: of a drive in a circle of 126 m.
std::shared_ptr<const SparseMap> makeWorld(uint32_t seed);

/// A drive that saw part of a world: some of its keyframes, in a frame of its own, on another day.
std::shared_ptr<const SparseMap> driveThrough(
    const SparseMap& world, const std::string& name, int day, const RigidTransform& drive_from_world,
    const std::function<bool(int)>& has_keyframe,
    const std::function<bool(int)>& shows_landmark = [](int) { return true; });

}  // namespace vcharge::testing
