#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace vcharge::emulator {

/// Properties of an emulated camera.
struct CameraConfig {
  uint32_t width = 1280, height = 800;
  std::vector<std::string> formats = {"GREY"};  ///< four character codes
  double rate_hz = 12.5;                        ///< trigger rate; pulses are at multiples of the period
  std::string capabilities = "capture";         ///< "capture", "output" or "no_streaming"
  int64_t exposure_us = 5000;                   ///< time from the pulse to the frame's stamp
  int64_t readout_us = 20000;                   ///< time from the pulse to the delivery of the frame
  int64_t jitter_us = 0;                        ///< largest error of the stamps
  uint64_t drop_every = 0;                      ///< loses every n-th frame (its number is counted); 0: none
  uint64_t damage_every = 0;                    ///< flags every n-th frame as damaged
  uint64_t short_every = 0;                     ///< delivers only half of the bytes of every n-th frame
  uint64_t silent_after = 0;                    ///< stops after this number of frames; 0: never
  std::map<std::string, int> failures;          ///< errno of failing ioctls, by name: fail=STREAMON:5
  bool unknown_clock = false;
  bool stamps_start = false;  ///< stamps are flagged as those of the start of the exposure
};

/// Reads the file that represents the device node: lines "key=value".
CameraConfig readCameraConfig(const std::string& path);

}  // namespace vcharge::emulator
