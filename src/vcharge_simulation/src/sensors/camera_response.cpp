#include "vcharge_simulation/sensors/camera_response.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "vcharge_core/base/error.h"
#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr int kTableSize = 8192;
constexpr int kNormalTableBits = 12;

// Quantiles of the normal distribution, by bisection of its distribution function.
std::vector<float> makeNormalTable() {
  std::vector<float> table(1U << kNormalTableBits);
  for (size_t i = 0; i < table.size(); ++i) {
    const double probability = (static_cast<double>(i) + 0.5) / static_cast<double>(table.size());
    double low = -6.0;
    double high = 6.0;
    for (int step = 0; step < 60; ++step) {
      const double middle = 0.5 * (low + high);
      (0.5 * std::erfc(-middle / std::sqrt(2.0)) < probability ? low : high) = middle;
    }
    table[i] = static_cast<float>(0.5 * (low + high));
  }
  return table;
}

// Index of an amount of exposed light in tables over its square root.
size_t indexOfLight(float exposed) {
  const float root = std::sqrt(std::min(1.0F, std::max(0.0F, exposed)));
  return static_cast<size_t>(root * kTableSize + 0.5F);  // NOLINT: not negative
}

double exposedLightAt(int index) {
  const double root = static_cast<double>(index) / kTableSize;
  return root * root;
}

// Mean and standard deviation of the gray value.
struct NoisyGray {
  float mean, deviation;
};

NoisyGray noisyGray(const CameraResponse& response, double light, double gain) {
  constexpr double kReadNoise = CameraResponse::kReadNoise;
  const double exposed = light * CameraResponse::kExposure;
  const double sigma_light =
      std::sqrt(gain * CameraResponse::kPhotonNoise * exposed + gain * gain * kReadNoise * kReadNoise) /
      CameraResponse::kExposure;
  const double low = std::max(0.0, light - sigma_light);
  const double slope = (response.grayFromLight(light + sigma_light) - response.grayFromLight(low)) /
                       (light + sigma_light - low + 1e-12);
  return {static_cast<float>(response.grayFromLight(light)), static_cast<float>(slope * sigma_light)};
}

}  // namespace

CameraResponse::CameraResponse() {
  gray_by_root_light_.resize(kTableSize + 1);
  for (int i = 0; i <= kTableSize; ++i) {
    gray_by_root_light_[static_cast<size_t>(i)] =
        static_cast<uint8_t>(std::lround(grayFromLight(exposedLightAt(i) / kExposure)));
  }
}

double CameraResponse::grayFromLight(double light) const {
  const double x = std::max(0.0, light * kExposure);
  const double w = kShoulder;
  return 255.0 * std::pow(std::min(1.0, x * (1.0 + w) / (x + w)), kGamma);
}

double CameraResponse::lightFromGray(double gray) const {
  const double y = std::pow(std::clamp(gray / 255.0, 0.0, 1.0), 1.0 / kGamma);
  const double w = kShoulder;
  return y * w / (1.0 + w - y) / kExposure;
}

cv::Mat CameraResponse::develop(const cv::Mat& light) const {
  check(light.type() == CV_32FC1, "CameraResponse::develop: expected CV_32FC1");
  cv::Mat gray(light.size(), CV_8UC1);
  const auto exposure = static_cast<float>(kExposure);
  for (int y = 0; y < light.rows; ++y) {
    const float* in = light.ptr<float>(y);
    uint8_t* out = gray.ptr(y);
    for (int x = 0; x < light.cols; ++x) {
      out[x] = gray_by_root_light_[indexOfLight(in[x] * exposure)];
    }
  }
  return gray;
}

cv::Mat CameraResponse::expose(const cv::Mat& clean, const Exposure& exposure) const {
  const double factor = exposure.factor * exposure.gain;
  if (clean.type() == CV_32FC1) {
    return develop(clean * factor);
  }
  check(clean.type() == CV_8UC1, "CameraResponse::expose: expected CV_8UC1 or CV_32FC1");
  cv::Mat table(1, 256, CV_8UC1);
  for (int gray = 0; gray < 256; ++gray) {
    table.at<uint8_t>(gray) = static_cast<uint8_t>(std::lround(grayFromLight(factor * lightFromGray(gray))));
  }
  cv::Mat exposed;
  cv::LUT(clean, table, exposed);
  return exposed;
}

cv::Mat CameraResponse::addNoise(const cv::Mat& clean, uint64_t seed, int camera, int64_t frame,
                                 const Exposure& exposure) const {
  const bool is_light = clean.type() == CV_32FC1;
  check(is_light || clean.type() == CV_8UC1, "CameraResponse::addNoise: expected CV_8UC1 or CV_32FC1");
  static const std::vector<float> normal_table = makeNormalTable();
  const double factor = exposure.factor * exposure.gain;
  std::vector<NoisyGray> table;
  for (int i = 0; i < (is_light ? kTableSize + 1 : 256); ++i) {
    const double light = is_light ? exposedLightAt(i) / kExposure : factor * lightFromGray(i);
    table.push_back(noisyGray(*this, light, exposure.gain));
  }
  // One key per image and one hash per pixel: noise depends only on the arguments and the pixel's position.
  Random key_source(seed * 0x9E3779B97F4A7C15ULL + static_cast<uint64_t>(frame) * 64U +
                    static_cast<uint64_t>(camera));
  const auto key = static_cast<uint32_t>(key_source.bits());
  const auto exposed_per_light = static_cast<float>(factor * kExposure);
  cv::Mat noisy(clean.size(), CV_8UC1);
  for (int y = 0; y < clean.rows; ++y) {
    uint8_t* out = noisy.ptr(y);
    const uint32_t row_key = mixBits(key + static_cast<uint32_t>(y) * 0x9E3779B1U);
    for (int x = 0; x < clean.cols; ++x) {
      const NoisyGray& gray =
          table[is_light ? indexOfLight(clean.ptr<float>(y)[x] * exposed_per_light) : clean.ptr(y)[x]];
      const uint32_t bits = mixBits(row_key ^ (static_cast<uint32_t>(x) * 0x85EBCA77U));
      const float value = gray.mean + gray.deviation * normal_table[bits >> (32 - kNormalTableBits)];
      out[x] = static_cast<uint8_t>(std::min(255.0F, std::max(0.0F, value + 0.5F)));
    }
  }
  return noisy;
}

}  // namespace vcharge
