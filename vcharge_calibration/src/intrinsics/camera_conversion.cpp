#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include <ceres/ceres.h>

#include "intrinsics/intrinsic_optimizer.h"
#include "vcharge_calibration/intrinsics/intrinsics_files.h"

namespace vcharge {

namespace {

constexpr int kSamplesAcross = 60;
constexpr size_t kMinSamples = 50;
// Beyond this angle, most of a plane image would show the rim of the field of view.
constexpr double kMaxPinholeAngle_rad = 1.2217;
constexpr int kMaxIterations = 500;
// The fit proceeds from the centre outwards, since an initial camera without distortion is only valid
// near the axis.
constexpr double kAngleSteps_rad[] = {0.5, 0.9, 1.3, 4.0};

struct Sample {
  Eigen::Vector3d ray;
  Eigen::Vector2d pixel;
};

/// Difference between a ray's pixels in the new and in the old model (2 residuals).
template <class Model>
class SampleCost : public ceres::SizedCostFunction<2, Model::kNumParameters> {
 public:
  explicit SampleCost(const Sample& sample) : sample_(sample) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    try {
      const Model model{
          typename Model::Parameters(Eigen::Map<const typename Model::Parameters>(parameters[0]))};
      Eigen::Vector2d pixel;
      Eigen::Matrix<double, 2, 3> by_point;
      Eigen::Matrix<double, 2, Model::kNumParameters> by_parameters;
      if (!model.project(sample_.ray, &pixel, &by_point, &by_parameters)) {
        return false;
      }
      Eigen::Map<Eigen::Vector2d>(residuals, 2) = pixel - sample_.pixel;
      if (jacobians != nullptr && jacobians[0] != nullptr) {
        Eigen::Map<Eigen::Matrix<double, 2, Model::kNumParameters, Eigen::RowMajor>> by(jacobians[0]);
        by = by_parameters;
      }
    } catch (const std::invalid_argument&) {
      return false;
    }
    return true;
  }

 private:
  const Sample sample_;
};

std::vector<Sample> samplesOf(const CameraModel& camera, cv::Size size, double max_angle_rad) {
  std::vector<Sample> samples;
  const double step = std::max(1.0, static_cast<double>(size.width) / kSamplesAcross);
  for (double y = 0.0; y <= size.height - 1; y += step) {
    for (double x = 0.0; x <= size.width - 1; x += step) {
      Eigen::Vector3d ray;
      if (camera.unproject({x, y}, &ray) && std::atan2(ray.head<2>().norm(), ray.z()) <= max_angle_rad) {
        samples.push_back({ray, {x, y}});
      }
    }
  }
  return samples;
}

template <class Model>
Eigen::VectorXd fit(const std::vector<Sample>& samples, const Eigen::VectorXd& start) {
  typename Model::Parameters parameters = start;
  for (const double max_angle_rad : kAngleSteps_rad) {
    ceres::Problem problem;
    for (const Sample& sample : samples) {
      Eigen::Vector2d pixel;
      if (std::acos(std::clamp(sample.ray.z(), -1.0, 1.0)) <= max_angle_rad &&
          Model(parameters).project(sample.ray, &pixel)) {
        problem.AddResidualBlock(new SampleCost<Model>(sample), nullptr, parameters.data());
      }
    }
    if (problem.NumResidualBlocks() < static_cast<int>(kMinSamples)) {
      continue;
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.max_num_iterations = kMaxIterations;
    options.function_tolerance = 1e-14;
    options.parameter_tolerance = 1e-14;
    options.gradient_tolerance = 1e-14;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
  }
  return parameters;
}

// Initial parameters: focal length and centre near the axis, without distortion.
Eigen::VectorXd startFor(const std::string& model_name, const CameraModel& camera) {
  const double small = 1e-3;
  Eigen::Vector2d middle;
  Eigen::Vector2d right;
  Eigen::Vector2d below;
  if (!camera.project(Eigen::Vector3d(0.0, 0.0, 1.0), &middle) ||
      !camera.project(Eigen::Vector3d(small, 0.0, 1.0), &right) ||
      !camera.project(Eigen::Vector3d(0.0, small, 1.0), &below)) {
    throw std::invalid_argument("the camera has no image of its axis");
  }
  const double fx = (right.x() - middle.x()) / small;
  const double fy = (below.y() - middle.y()) / small;
  Eigen::VectorXd start =
      Eigen::VectorXd::Zero(static_cast<Eigen::Index>(CameraModel::parameterNames(model_name).size()));
  if (model_name == MeiCamera::kName) {
    start.head<5>() << 1.0, 2.0 * fx, 2.0 * fy, middle;
  } else {
    start.head<4>() << fx, fy, middle;
  }
  return start;
}

}  // namespace

ConvertedCamera convertCamera(const CameraModel& camera, cv::Size image_size_px, double field_of_view_rad,
                              const std::string& model_name) {
  const Eigen::VectorXd start = startFor(model_name, camera);
  const double max_angle_rad = 0.5 * field_of_view_rad;
  const std::vector<Sample> all = samplesOf(camera, image_size_px, max_angle_rad);
  std::vector<Sample> samples = all;
  if (model_name == PinholeCamera::kName) {
    samples = samplesOf(camera, image_size_px, std::min(max_angle_rad, kMaxPinholeAngle_rad));
  }
  if (samples.size() < kMinSamples) {
    throw std::invalid_argument("the camera has too few pixels within its field of view to be converted");
  }
  ConvertedCamera result{camera, 0.0, 0.0, 1.0};
  if (camera.name() != model_name) {
    Eigen::VectorXd parameters;
    if (model_name == MeiCamera::kName) {
      parameters = fit<MeiCamera>(samples, start);
    } else if (model_name == KannalaBrandtCamera::kName) {
      parameters = fit<KannalaBrandtCamera>(samples, start);
    } else {
      parameters = fit<PinholeCamera>(samples, start);
    }
    result.model = CameraModel::create(model_name, parameters);
  }
  double sum = 0.0;
  size_t count = 0;
  for (const Sample& sample : samples) {
    Eigen::Vector2d pixel;
    if (result.model.project(sample.ray, &pixel)) {
      const double distance_px = (pixel - sample.pixel).norm();
      sum += distance_px * distance_px;
      result.max_px = std::max(result.max_px, distance_px);
      ++count;
    }
  }
  result.rms_px = std::sqrt(sum / std::max<double>(1.0, static_cast<double>(count)));
  result.covered_fraction = static_cast<double>(count) / static_cast<double>(all.size());
  return result;
}

}  // namespace vcharge
