#pragma once

namespace vcharge {

/// Rays closer than 20 degrees to the direction of travel, or its opposite, are judged separately or not:
/// motion stereo has little parallax there.
constexpr double kMinAngleFromTravel_rad = 0.3490658503988659;

}  // namespace vcharge
