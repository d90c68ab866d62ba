#include "scenes/ground_finder.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <tbb/parallel_for.h>

namespace vcharge {

namespace {

constexpr int kPacket = 16;
constexpr uint32_t kNoGround = std::numeric_limits<uint32_t>::max();
// The sample of a block that is nearest to its centre.
constexpr int kMiddleSample = 3;
// Largest distance of neighbouring points from a common plane.
constexpr float kPlaneTolerance_m = 0.001F;

}  // namespace

GroundFinder::GroundFinder(const ExposedRows& rows, const SurfaceShader& shader, const CameraView& view)
    : rows_(rows), shader_(shader), view_(view) {
  const size_t num_blocks = static_cast<size_t>(view.blocksPerRow()) * static_cast<size_t>(view.blockRows());
  probes_.resize(num_blocks);
  planes_.resize(num_blocks);
  plain_.assign(num_blocks, 0);
  tbb::parallel_for(0, view.blockRows(), [&](int block_y) { probeRow(block_y); });
  tbb::parallel_for(1, std::max(1, view.blockRows() - 1), [&](int block_y) { findPlainRow(block_y); });
}

void GroundFinder::probeRow(int block_y) {
  const ExposedRow& row = rows_[block_y];
  const int blocks = view_.blocksPerRow();
  const size_t first = static_cast<size_t>(block_y) * static_cast<size_t>(blocks);
  for (int start = 0; start < blocks; start += kPacket) {
    RTCRayHit16 rays;
    alignas(64) int active[kPacket];
    for (int i = 0; i < kPacket; ++i) {
      const bool inside = start + i < blocks;
      const size_t block = first + static_cast<size_t>(std::min(start + i, blocks - 1));
      const float* sample = view_.blockRays(block) + kMiddleSample;
      const Eigen::Vector3f ray =
          row.rotation * Eigen::Vector3f(sample[0], sample[CameraView::kSamplesPerBlock],
                                         sample[2 * CameraView::kSamplesPerBlock]);
      rays.ray.org_x[i] = row.origin.x();
      rays.ray.org_y[i] = row.origin.y();
      rays.ray.org_z[i] = row.origin.z();
      rays.ray.dir_x[i] = ray.x();
      rays.ray.dir_y[i] = ray.y();
      rays.ray.dir_z[i] = ray.z();
      rays.ray.tnear[i] = 0.0F;
      rays.ray.tfar[i] = std::numeric_limits<float>::infinity();
      rays.ray.time[i] = 0.0F;
      rays.ray.mask[i] = 0xFFFFFFFFU;
      rays.ray.id[i] = 0;
      rays.ray.flags[i] = 0;
      rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
      rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
      // Only blocks that are entirely in the field of view and do not show the own car.
      active[i] = inside && view_.blockPixels(block) == 0xF && view_.blockBodyMask(block) == 0 ? -1 : 0;
    }
    row.instant->intersect(active, &rays);
    for (int i = 0; i < kPacket && start + i < blocks; ++i) {
      const size_t block = first + static_cast<size_t>(start + i);
      probes_[block].material = kNoGround;
      if (active[i] == 0 || rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID ||
          shader_.materialOf(rays.hit.primID[i]).mapping != Material::Mapping::kGround) {
        continue;
      }
      const Eigen::Vector3f ray(rays.ray.dir_x[i], rays.ray.dir_y[i], rays.ray.dir_z[i]);
      const Eigen::Vector3f normal =
          Eigen::Vector3f(rays.hit.Ng_x[i], rays.hit.Ng_y[i], rays.hit.Ng_z[i]).normalized();
      probes_[block] = {row.origin + rays.ray.tfar[i] * ray, shader_.materialIndexOf(rays.hit.primID[i])};
      planes_[block] = {normal, normal.dot(probes_[block].point), rays.hit.primID[i]};
    }
  }
}

void GroundFinder::findPlainRow(int block_y) {
  const int blocks = view_.blocksPerRow();
  for (int block_x = 1; block_x + 1 < blocks; ++block_x) {
    const size_t block =
        static_cast<size_t>(block_y) * static_cast<size_t>(blocks) + static_cast<size_t>(block_x);
    const Probe& middle = probes_[block];
    const Plane& plane = planes_[block];
    bool plain = middle.material != kNoGround;
    for (int k = 0; k < 9 && plain; ++k) {
      const Probe& beside = probes_[block + static_cast<size_t>((k / 3 - 1) * blocks + k % 3 - 1)];
      plain = beside.material == middle.material &&
              std::abs(plane.normal.dot(beside.point) - plane.offset) < kPlaneTolerance_m &&
              (beside.point - middle.point).squaredNorm() < 2.0F * kMaxSpacing_m * kMaxSpacing_m;
    }
    plain_[block] = plain ? 1 : 0;
  }
}

}  // namespace vcharge
