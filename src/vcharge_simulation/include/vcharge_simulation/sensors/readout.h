#pragma once

#include <utility>

#include "vcharge_simulation/vehicle/motion_window.h"

namespace vcharge {

/// Readout of an image by a rolling shutter, rows from top to bottom: row r of H is exposed
/// readout_time_s * ((r + 0.5) / H - 0.5) after the middle row. A global shutter exposes all rows at once.
struct Readout {
  Readout(const RigidTransform& world_from_vehicle)  // NOLINT: implicit by design
      : motion(world_from_vehicle) {}
  Readout(MotionWindow window, double time_s) : motion(std::move(window)), readout_time_s(time_s) {}

  MotionWindow motion;          ///< covers the readout
  double readout_time_s = 0.0;  ///< time per row times number of rows; 0: global shutter
  double middle_s = 0.0;        ///< exposure of the middle row, after the middle of the window

  /// Time after the stamp at a fraction of the image height, 0 at the upper border.
  double timeAt(double fraction) const { return middle_s + readout_time_s * (fraction - 0.5); }
  double timeOfRow(double row, int num_rows) const { return timeAt((row + 0.5) / num_rows); }
};

}  // namespace vcharge
