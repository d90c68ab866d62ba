#include "kernels/sweep_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>

#include <hwy/targets.h>

#include "kernels/sweep_kernels_internal.h"

namespace vcharge {
namespace {

// A window whose sum of squares about its mean is smaller is constant.
constexpr float kMinSquares_gray2 = 1e-3f;
constexpr int kLargestGray = 127;  // magnitude of a gray level minus 128

/// What an older computer does can be measured on a newer one.
void forbidInstructions() {
  const char* allowed = std::getenv("VCHARGE_INSTRUCTIONS");
  if (allowed == nullptr || std::string_view(allowed).empty()) {
    return;
  }
  if (std::string_view(allowed) != "avx2") {
    throw std::invalid_argument(std::string("VCHARGE_INSTRUCTIONS: expected avx2 or nothing, got ") +
                                allowed);
  }
#if HWY_ARCH_X86
  hwy::DisableTargets(HWY_AVX2 - 1);  // better instruction sets have lower bits
#endif
}

}  // namespace

SampleScale SampleScale::forWindow(int window_px) {
  const double count = window_px * window_px;
  const double full = kLargestGray * kWeightSum * kWeightSum;
  SampleScale scale;
  // The square of `unseen` must exceed the squares of all n samples of a window, and n of it must fit into 32
  // bits.
  const double unseen = std::floor(std::sqrt(4294967295.0 / count));
  const auto largest = [&] { return full / (1 << scale.shift) + 1.0; };
  const auto squaresOf = [&] { return count * largest() * largest(); };
  // Minimum sum of squares about the mean of a window with an unseen sample.
  const auto leastWithUnseen = [&] {
    return (count - 1.0) / count * (unseen - largest()) * (unseen - largest());
  };
  scale.shift = 8;
  while (unseen <= largest() || leastWithUnseen() <= 1.01 * squaresOf()) {
    ++scale.shift;
  }
  scale.unseen = static_cast<int32_t>(unseen);
  scale.max_squares = static_cast<float>(1.005 * squaresOf());
  const auto per_gray = static_cast<float>(kWeightSum * kWeightSum) / static_cast<float>(1 << scale.shift);
  scale.min_squares = kMinSquares_gray2 * per_gray * per_gray;
  return scale;
}

int32_t SampleScale::sample(int gray) const {
  return ((std::max(gray, 1) - 128) * kWeightSum * kWeightSum + (1 << (shift - 1))) >> shift;
}

SweepKernels sweepKernels() {
  static std::once_flag once;
  std::call_once(once, forbidInstructions);
  SweepKernels kernels{};
  addWarpKernels(&kernels);
  addCorrelationKernels(&kernels);
  addVoteKernels(&kernels);
  addUncertaintyKernels(&kernels);
  return kernels;
}

}  // namespace vcharge
