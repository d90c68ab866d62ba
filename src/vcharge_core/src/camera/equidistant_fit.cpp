#include "vcharge_core/camera/equidistant_fit.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include <Eigen/QR>

namespace vcharge {
namespace {

constexpr int kMinSamples = 50;
constexpr double kTargetSamples = 3000.0;
constexpr int kMaxIterations = 30;

// A pixel and the direction of its ray: the angle from the axis, and the unit vector in the image plane.
struct Sample {
  Eigen::Vector2d pixel;
  Eigen::Vector2d direction;
  double angle_rad;
};

std::vector<Sample> takeSamples(const CameraModel& camera, cv::Size size, double field_of_view_rad) {
  const int step =
      std::max(1, static_cast<int>(std::sqrt(static_cast<double>(size.area()) / kTargetSamples)));
  std::vector<Sample> samples;
  for (int y = 0; y < size.height; y += step) {
    for (int x = 0; x < size.width; x += step) {
      Sample sample;
      sample.pixel = Eigen::Vector2d(x, y);
      Eigen::Vector3d ray;
      if (!camera.unproject(sample.pixel, &ray)) {
        continue;
      }
      const double sine = ray.head<2>().norm();
      sample.angle_rad = std::atan2(sine, ray.z());
      sample.direction = sine > 0.0 ? Eigen::Vector2d(ray.head<2>() / sine) : Eigen::Vector2d::Zero();
      if (sample.angle_rad <= 0.5 * field_of_view_rad) {
        samples.push_back(sample);
      }
    }
  }
  return samples;
}

// With one focal length for both axes the model is linear in (cx, cy, f, f k1, ..., f k4).
KannalaBrandtCamera::Parameters fitLinear(const std::vector<Sample>& samples) {
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(2 * samples.size(), 7);
  Eigen::VectorXd pixels(2 * samples.size());
  for (size_t i = 0; i < samples.size(); ++i) {
    double power = samples[i].angle_rad;
    for (int k = 0; k < 5; ++k, power *= samples[i].angle_rad * samples[i].angle_rad) {
      design.block<2, 1>(2 * i, 2 + k) = power * samples[i].direction;
    }
    design.block<2, 2>(2 * i, 0).setIdentity();
    pixels.segment<2>(2 * i) = samples[i].pixel;
  }
  const Eigen::VectorXd solution = design.colPivHouseholderQr().solve(pixels);
  KannalaBrandtCamera::Parameters parameters;
  parameters << solution[2], solution[2], solution[0], solution[1], solution.tail<4>() / solution[2];
  return parameters;
}

double radius(const KannalaBrandtCamera::Parameters& p, double angle) {
  const double square = angle * angle;
  return angle * (1.0 + square * (p[4] + square * (p[5] + square * (p[6] + square * p[7]))));
}

Eigen::Vector2d residual(const KannalaBrandtCamera::Parameters& p, const Sample& sample) {
  return radius(p, sample.angle_rad) * sample.direction.cwiseProduct(p.head<2>()) + p.segment<2>(2) -
         sample.pixel;
}

double sumOfSquares(const KannalaBrandtCamera::Parameters& p, const std::vector<Sample>& samples) {
  double sum = 0.0;
  for (const Sample& sample : samples) {
    sum += residual(p, sample).squaredNorm();
  }
  return sum;
}

KannalaBrandtCamera::Parameters gaussNewtonStep(const KannalaBrandtCamera::Parameters& p,
                                                const std::vector<Sample>& samples) {
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(2 * samples.size(), 8);
  Eigen::VectorXd residuals(2 * samples.size());
  for (size_t i = 0; i < samples.size(); ++i) {
    const Sample& sample = samples[i];
    const double r = radius(p, sample.angle_rad);
    jacobian(2 * i, 0) = r * sample.direction.x();
    jacobian(2 * i + 1, 1) = r * sample.direction.y();
    jacobian.block<2, 2>(2 * i, 2).setIdentity();
    double power = sample.angle_rad;
    for (int k = 0; k < 4; ++k) {
      power *= sample.angle_rad * sample.angle_rad;
      jacobian.block<2, 1>(2 * i, 4 + k) = power * sample.direction.cwiseProduct(p.head<2>());
    }
    residuals.segment<2>(2 * i) = residual(p, sample);
  }
  return -jacobian.colPivHouseholderQr().solve(residuals);
}

}  // namespace

EquidistantFit fitEquidistant(const CameraModel& camera, cv::Size image_size_px, double field_of_view_rad) {
  const std::vector<Sample> samples = takeSamples(camera, image_size_px, field_of_view_rad);
  if (samples.size() < kMinSamples) {
    throw std::invalid_argument("fitEquidistant: only " + std::to_string(samples.size()) +
                                " pixels have a ray in the field of view");
  }
  KannalaBrandtCamera::Parameters parameters = fitLinear(samples);
  double cost = sumOfSquares(parameters, samples);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const KannalaBrandtCamera::Parameters next = parameters + gaussNewtonStep(parameters, samples);
    const double next_cost = sumOfSquares(next, samples);
    if (!(next_cost < cost)) {
      break;
    }
    const bool converged = cost - next_cost <= 1e-12 * cost;
    parameters = next;
    cost = next_cost;
    if (converged) {
      break;
    }
  }

  EquidistantFit fit{KannalaBrandtCamera(parameters)};
  fit.num_samples = static_cast<int>(samples.size());
  fit.rms_px = std::sqrt(cost / static_cast<double>(samples.size()));
  for (const Sample& sample : samples) {
    fit.max_px = std::max(fit.max_px, residual(parameters, sample).norm());
    if (sample.angle_rad > fit.camera.maxAngle()) {
      throw std::invalid_argument("fitEquidistant: the fit is not one-to-one over the field of view");
    }
  }
  return fit;
}

}  // namespace vcharge
