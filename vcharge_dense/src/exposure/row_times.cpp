#include "exposure/row_times.h"

#include "vcharge_core/base/wide_loops.h"

namespace vcharge {

VCHARGE_WIDE_LOOPS void exposureTimesOfRow(const MeiCamera& camera, const ExposureTimes& times,
                                           const float* u, const float* v, size_t count, float* time_s) {
  const float per_fx = 1.0F / static_cast<float>(camera.gamma1());
  const float per_fy = 1.0F / static_cast<float>(camera.gamma2());
  const auto cx = static_cast<float>(camera.u0()), cy = static_cast<float>(camera.v0());
  const Eigen::Vector4f c = times.coefficients_s.cast<float>();
  const float c0 = c[0], c1 = c[1], c2 = c[2], c3 = c[3];
  const float along_x = times.lines_are_columns ? 1.0F : 0.0F, along_y = 1.0F - along_x;
  for (size_t i = 0; i < count; ++i) {
    const float x = (u[i] - cx) * per_fx, y = (v[i] - cy) * per_fy, squared = x * x + y * y;
    time_s[i] = c0 + (along_x * x + along_y * y) * (c1 + squared * (c2 + squared * c3));
  }
}

}  // namespace vcharge
