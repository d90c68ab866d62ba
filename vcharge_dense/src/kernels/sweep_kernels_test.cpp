// Tests of the sweep's inner loops against formulas, on every instruction set of the machine.
#include "kernels/sweep_kernels.h"

#include <algorithm>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "kernels/packed_image.h"
#include "reference/plane_sweep_test_support.h"
#include "sweep/node_grid.h"
#include "sweep/tile_layout.h"

namespace vcharge {
namespace {

/// Projection of kCamera without a margin.
Projection projectionOf(const RigidTransform& neighbour_from_reference) {
  Projection p{224.0f, 223.5f, 162.0f, 99.5f, 1.158f, 0.0f, 0.0f, 319.0f, 199.0f, {}, {}};
  for (int i = 0; i < 9; ++i) {
    p.rotation[i] = static_cast<float>(neighbour_from_reference.rotationMatrix()(i / 3, i % 3));
  }
  for (int i = 0; i < 3; ++i) {
    p.translation[i] = static_cast<float>(neighbour_from_reference.translation()[i]);
  }
  return p;
}

/// Position in the packed image that the grid's cells give for a pixel of the tile.
Eigen::Vector2d positionFromCells(const NodeGrid& grid, const AlignedArray<float>& cells,
                                  const TileLayout& layout, int row, int column) {
  const auto lanes = static_cast<size_t>(layout.lanes);
  const int in_strip = column % layout.strip;
  const size_t cell = static_cast<size_t>(in_strip >> grid.cellShift());
  const float* at = cells.data() + grid.cellOffset(row) + cell * kCellCoefficients * lanes +
                    static_cast<size_t>(column / layout.strip);
  const double r = grid.rowInCell(row);
  const double s = in_strip & ((1 << grid.cellShift()) - 1);
  Eigen::Vector2d position;
  for (size_t coordinate = 0; coordinate < 2; ++coordinate) {
    double values[3];
    for (size_t i = 0; i < 3; ++i) {
      const float* c = at + (9 * coordinate + 3 * i) * lanes;
      values[i] = c[0] + r * (c[lanes] + r * static_cast<double>(c[2 * lanes]));
    }
    position[static_cast<int>(coordinate)] =
        (values[0] + s * values[1] + 0.5 * s * (s - 1.0) * values[2]) / (1 << kPositionBits);
  }
  return position;
}

TEST(NodeGridTest, ErrorOfTheInterpolatedWarpIsWithinItsBound) {
  const PlaneSweepOptions options;
  int judged = 0, within_tolerance = 0, all = 0;
  for (const RigidTransform& camera_pose : {kLeft, kFront}) {
    const Plane ground = groundInCamera(camera_pose);
    for (const PlaneFamily& family : makePlaneFamilies(options, ground)) {
      for (const double baseline_m : {0.1, 0.4, 0.8}) {
        // The neighbour also rotates, by half a degree per 0.1 m.
        const RigidTransform neighbour(
            camera_pose.rotation() * rotationFromVector(Eigen::Vector3d(0.02, -0.06, 0.03) * baseline_m),
            camera_pose.translation() - Eigen::Vector3d(baseline_m, 0.0, 0.0));
        const RigidTransform neighbour_from_reference = neighbour.inverse() * camera_pose;
        const Eigen::Matrix3d rotation = neighbour_from_reference.rotationMatrix();
        const Eigen::Vector3d& translation = neighbour_from_reference.translation();
        Projection projection = projectionOf(neighbour_from_reference);
        projection.cx += 32.0f;
        projection.cy += 32.0f;
        projection.min_x = projection.min_y = 4.0f;
        projection.max_x = 379.0f;
        projection.max_y = 259.0f;
        const SweepKernels kernels = sweepKernels();
        const TileLayout layout{kernels.lanes, (kSize.width + kernels.lanes - 1) / kernels.lanes, 70};
        const cv::Point origin(0, 60);
        for (const int spacing : {8, 4}) {
          NodeGrid grid(kCamera, allValid(), origin, layout, spacing);
          grid.setNormal(family.normal.cast<float>());
          for (size_t k = 0; k < family.inverse_distances_per_m.size(); k += 7) {
            const double inverse_distance = family.inverse_distances_per_m[k];
            AlignedArray<float> cells;
            const float bound_px =
                grid.makeCells(kernels, projection, family.inverse_distances_per_m[k], &cells);
            ++all;
            within_tolerance += bound_px <= options.warp_tolerance_px ? 1 : 0;
            if (!(bound_px <= 0.25f)) {
              continue;  // a finer grid or the exact projection would be used
            }
            double largest = 0.0;
            for (int row = 0; row < layout.rows; row += 3) {
              for (int column = 0; column < kSize.width; ++column) {
                const Eigen::Vector2d position = positionFromCells(grid, cells, layout, row, column);
                Eigen::Vector3d ray;
                Eigen::Vector2d pixel;
                if (position.isZero() || !kCamera.unproject({column, origin.y + row}, &ray)) {
                  continue;  // unseen
                }
                const double inverse_range = -family.normal.dot(ray) * inverse_distance;
                ASSERT_TRUE(kCamera.project(rotation * ray + inverse_range * translation, &pixel));
                const Eigen::Vector2d exact = pixel + Eigen::Vector2d(32.0, 32.0);
                largest = std::max(largest, (position - exact).cwiseAbs().maxCoeff());
                ++judged;
              }
            }
            EXPECT_LE(largest, 1.2 * bound_px + 0.002)
                << "baseline " << baseline_m << ", plane " << k << ", spacing " << spacing;
          }
        }
      }
    }
  }
  EXPECT_GT(judged, 1000000);
  EXPECT_GT(within_tolerance, 0.8 * all);
}

TEST(SampleScaleTest, OneUnseenSampleInvalidatesAnyWindow) {
  for (int window = 3; window <= 31; window += 2) {
    const SampleScale scale = SampleScale::forWindow(window);
    const int64_t count = window * window;
    const int64_t low = scale.sample(0), high = scale.sample(255);
    EXPECT_LE(static_cast<double>(count) * 0.25 * static_cast<double>((high - low) * (high - low)),
              scale.max_squares)
        << "any window of gray levels counts";
    for (const int64_t gray : {low, high}) {
      for (int64_t unseen = 1; unseen <= count; ++unseen) {
        // Sums in 32 bits, as in the kernels.
        const int64_t sum = unseen * scale.unseen + (count - unseen) * gray;
        const int64_t exact = unseen * scale.unseen * scale.unseen + (count - unseen) * gray * gray;
        const auto squares = static_cast<float>(static_cast<int32_t>(static_cast<uint32_t>(exact)));
        const float about_mean =
            squares - static_cast<float>(sum) / static_cast<float>(count) * static_cast<float>(sum);
        EXPECT_FALSE(about_mean > scale.min_squares && about_mean < scale.max_squares)
            << "window " << window << ", " << unseen << " unseen";
      }
    }
  }
}

/// Expects that scores of the first sweep agree within a tolerance on all instruction sets.
void expectAgreement(const PlaneSweepOptions& options, float tolerance) {
  const Sequence s = makeSequence(lotScene(4), kLeft, 0.15, -4, 0, 1.0);
  cv::Mat mask = allValid();
  mask(cv::Rect(100, 150, 60, 50)).setTo(0);
  SweepDetails first;
  onEveryTarget([&] {
    SweepDetails details;
    sweepOf(s, options, &details, mask);
    if (first.plane.empty()) {
      first = details;
      return;
    }
    const cv::Mat known = details.score == details.score;
    EXPECT_EQ(cv::countNonZero(known != (first.score == first.score)), 0);
    cv::Mat difference = cv::abs(details.score - first.score);
    difference.setTo(0.0f, ~known);
    EXPECT_LE(cv::countNonZero(difference > tolerance), 0.001 * kSize.area());
    EXPECT_GE(cv::countNonZero(details.plane == first.plane),
              0.998 * kSize.area());  // two planes may have equal scores
    const cv::Mat other_voters = (details.voters != first.voters) & (details.plane == first.plane);
    EXPECT_LE(cv::countNonZero(other_voters), 0.001 * kSize.area());
  });
}

TEST(SweepKernelsTest, AllInstructionSetsAgree) {
  PlaneSweepOptions options;
  options.num_planes = 16;
  options.num_ground_planes = 8;
  options.num_refinement_steps = 0;  // it would start elsewhere if two planes have equal scores
  for (const Aggregation aggregation : {Aggregation::kMean, Aggregation::kReferenceSplit}) {
    options.aggregation = aggregation;
    expectAgreement(options, 0.002f);  // nodes depend on the number of lanes
  }
  // With every pixel projected sums are equal integers; reciprocal roots and rounding differ by 1e-4.
  options.warp_tolerance_px = 0.0;
  expectAgreement(options, 0.0002f);
}

TEST(SweepKernelsTest, LargestMotionIsTheProjectionsDerivative) {
  const RigidTransform slow(rotationFromVector({0.01, -0.02, 0.01}), {0.1, 0.02, 0.05});
  const RigidTransform fast(rotationFromVector({0.0, 0.03, 0.0}), {-0.4, 0.0, 0.1});
  const std::vector<RigidTransform> poses = {slow, fast};
  std::vector<NeighbourUncertainty> neighbours(2);
  for (size_t n = 0; n < 2; ++n) {
    neighbours[n].projection = projectionOf(poses[n]);
  }
  constexpr size_t kCount = 21;  // not a multiple of any vector
  std::vector<float> x(kCount), y(kCount), z(kCount), inverse_range(kCount), expected(kCount);
  for (size_t i = 0; i < kCount; ++i) {
    Eigen::Vector3d ray;
    ASSERT_TRUE(kCamera.unproject({10.0 + 14.0 * static_cast<double>(i), 60.0}, &ray));
    ray.normalize();
    x[i] = static_cast<float>(ray.x());
    y[i] = static_cast<float>(ray.y());
    z[i] = static_cast<float>(ray.z());
    const double here = 0.05 + 0.03 * static_cast<double>(i);
    inverse_range[i] = static_cast<float>(here);
    for (const RigidTransform& pose : poses) {
      Eigen::Vector2d before, after;
      ASSERT_TRUE(kCamera.project(pose.rotation() * ray + (here - 1e-5) * pose.translation(), &before));
      ASSERT_TRUE(kCamera.project(pose.rotation() * ray + (here + 1e-5) * pose.translation(), &after));
      expected[i] = std::max(expected[i], static_cast<float>((after - before).norm() / 2e-5));
    }
  }
  onEveryTarget([&] {
    std::vector<float> motion(kCount);
    UncertaintyRow row;
    row.count = kCount;
    row.ray_x = x.data();
    row.ray_y = y.data();
    row.ray_z = z.data();
    row.inverse_range = inverse_range.data();
    row.neighbours = neighbours.data();
    row.num_neighbours = 2;
    sweepKernels().largestMotion(row, motion.data());
    for (size_t i = 0; i < kCount; ++i) {
      EXPECT_NEAR(motion[i], expected[i], 1e-3f * expected[i]) << i;
    }
  });
}

TEST(SweepKernelsTest, StepsFollowTheProjection) {
  const RigidTransform pose(rotationFromVector({0.01, -0.02, 0.01}), {0.4, 0.05, 0.3});
  const Projection projection = projectionOf(pose);
  constexpr int kReach = kMaxStepReach;
  onEveryTarget([&] {
    const SweepKernels kernels = sweepKernels();
    const size_t count = 64;
    AlignedArray<float> x, y, z, base, weight;
    for (AlignedArray<float>* array : {&x, &y, &z, &base, &weight}) {
      array->resize(count);
    }
    for (size_t i = 0; i < count; ++i) {
      Eigen::Vector3d ray;
      ASSERT_TRUE(
          kCamera.unproject({4.9 * static_cast<double>(i), 40.0 + 2.0 * static_cast<double>(i)}, &ray));
      x[i] = static_cast<float>(ray.x());
      y[i] = static_cast<float>(ray.y());
      z[i] = static_cast<float>(ray.z());
      base[i] = 0.05f + 0.01f * static_cast<float>(i);
      weight[i] = i % 7 == 0 ? std::numeric_limits<float>::quiet_NaN() : 0.005f;
    }
    const RayRow rays{x.data(), y.data(), z.data(), base.data(), weight.data(), 0.0f};
    AlignedArray<int32_t> table[4], u, v, exact_u, exact_v;
    for (AlignedArray<int32_t>* array :
         {table, table + 1, table + 2, table + 3, &u, &v, &exact_u, &exact_v}) {
      array->resize(count);
    }
    const StepTable steps{table[0].data(), table[1].data(), table[2].data(), table[3].data()};
    kernels.makeSteps(projection, rays, 1.0f, kReach, count, steps);
    int seen = 0;
    for (int step = -kReach; step <= kReach; ++step) {
      RayRow at_step = rays;
      at_step.offset = static_cast<float>(step);
      kernels.walkSteps(steps, step, count, u.data(), v.data());
      kernels.projectFixed(projection, at_step, count, exact_u.data(), exact_v.data());
      for (size_t i = 0; i < count; ++i) {
        if (u[i] == 0 && v[i] == 0) {
          continue;  // invisible, at this step or at another one
        }
        ++seen;
        EXPECT_NEAR(u[i], exact_u[i], 0.03 * (1 << kPositionBits)) << "point " << i << ", step " << step;
        EXPECT_NEAR(v[i], exact_v[i], 0.03 * (1 << kPositionBits)) << "point " << i << ", step " << step;
      }
      EXPECT_EQ(u[7], 0) << "a point without an inverse range";
    }
    EXPECT_GT(seen, 30 * (2 * kReach + 1));
    // Steps that are longer than a table can tell are unseen.
    constexpr float kLong = 80.0f;
    AlignedArray<int32_t> before_u, before_v;
    before_u.resize(count);
    before_v.resize(count);
    RayRow before = rays, after = rays;
    before.offset = -kLong;
    after.offset = kLong;
    kernels.projectFixed(projection, before, count, before_u.data(), before_v.data());
    kernels.projectFixed(projection, after, count, exact_u.data(), exact_v.data());
    kernels.makeSteps(projection, rays, kLong, 1, count, steps);
    kernels.walkSteps(steps, 0, count, u.data(), v.data());
    int too_long = 0;
    for (size_t i = 0; i < count; ++i) {
      const bool is_visible = (before_u[i] != 0 || before_v[i] != 0) && (exact_u[i] != 0 || exact_v[i] != 0);
      if (is_visible && std::abs(exact_u[i] - before_u[i]) > 2 * 16.1 * (1 << kPositionBits)) {
        ++too_long;
        EXPECT_EQ(u[i], 0) << "point " << i;
        EXPECT_EQ(v[i], 0) << "point " << i;
      }
    }
    EXPECT_GT(too_long, 5);
  });
}

TEST(PackedImageTest, CellsHoldTheFourPixelsAroundThem) {
  cv::Mat pixels(5, 37, CV_8UC1), valid(pixels.size(), CV_8UC1, cv::Scalar(1));
  for (int y = 0; y < pixels.rows; ++y) {
    for (int x = 0; x < pixels.cols; ++x) {
      pixels.at<uint8_t>(y, x) = static_cast<uint8_t>(53 * y + 7 * x);  // some are 0 and 255
    }
  }
  pixels.at<uint8_t>(2, 3) = 0;
  pixels.at<uint8_t>(2, 4) = 255;
  valid.at<uint8_t>(3, 20) = 0;
  onEveryTarget([&] {
    const PackedImage packed(pixels, valid);
    for (int y = -1; y < pixels.rows; ++y) {
      for (int x = -1; x < pixels.cols; ++x) {
        const int32_t cell =
            packed.cells()[(y + PackedImage::kMargin) * packed.pitch() + x + PackedImage::kMargin];
        const bool is_inside = x >= 0 && y >= 0 && x + 1 < pixels.cols && y + 1 < pixels.rows;
        if (!is_inside || ((x == 19 || x == 20) && (y == 2 || y == 3))) {
          EXPECT_EQ(cell, kUnseenCell) << x << ", " << y;
          continue;
        }
        const int gray[] = {pixels.at<uint8_t>(y, x), pixels.at<uint8_t>(y + 1, x),
                            pixels.at<uint8_t>(y, x + 1), pixels.at<uint8_t>(y + 1, x + 1)};
        for (int i = 0; i < 4; ++i) {
          const auto byte = static_cast<int8_t>(static_cast<uint32_t>(cell) >> 8 * i & 0xffu);
          EXPECT_EQ(byte, std::max(gray[i] - 128, -127)) << x << ", " << y;
        }
      }
    }
  });
}

TEST(SweepKernelsTest, SumsOnlyNeighboursThatAgree) {
  constexpr size_t kCount = 21, kMargin = 2;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> values(kCount + 2 * kMargin, nan), middle(kCount), tolerance(kCount, 1.0f);
  for (size_t i = 0; i < kCount; ++i) {
    values[kMargin + i] = i < 10 ? 1.0f : 5.0f;
  }
  std::copy(values.begin() + kMargin, values.end() - kMargin, middle.begin());
  const float* rows[] = {values.data() + kMargin};
  onEveryTarget([&] {
    std::vector<float> number(kCount), sum(kCount);
    sweepKernels().sumAgreeing({kCount, rows, 1, 2, 1, middle.data(), tolerance.data()}, number.data(),
                               sum.data());
    EXPECT_EQ(number[0], 3.0f) << "a margin of NaN does not agree";
    EXPECT_EQ(number[5], 5.0f);
    EXPECT_EQ(number[9], 3.0f) << "beside the step";
    EXPECT_EQ(sum[9], 3.0f);
    EXPECT_EQ(sum[10], 15.0f);
    EXPECT_EQ(sum[kCount - 1], 15.0f);
  });
}

}  // namespace
}  // namespace vcharge
