#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_evaluation/error_distribution.h"
#include "vcharge_evaluation/obstacle_truth.h"

namespace vcharge {

/// What a map is asked for.
struct ObstacleMapEvaluationOptions {
  double min_height_m = 0.3;  ///< of an obstacle that must not be missed
  double min_width_m = 0.1;
  double corridor_m = 4.0;  ///< from the ground that the vehicle drives over
  double vehicle_half_width_m = 0.9;
  double view_range_m = 5.0;                              ///< an obstacle counts as viewed from here on
  double min_angle_from_travel_rad = 0.3490658503988659;  ///< and by rays so far from the direction of travel
  int min_seen_points = 15;                               ///< and with so many points
  double grace_m = 1.0;       ///< motion past the first view until it must be reported
  double tolerance_m = 0.25;  ///< an occupied cell so near reports an obstacle
  /// Around whatever rises to false_height_m the ground is not open: the range error that is allowed (15 cm)
  /// and the diagonal of a cell.
  double false_radius_m = 0.29;
  double false_height_m = 0.08;
  double false_range_m = 5.0;  ///< from the vehicle's middle; further away no cell is judged
  double kerb_min_m = 0.1;     ///< outlines of kerbs whose true height lies between are judged
  double kerb_max_m = 0.16;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("min_height_m", min_height_m);
    visit("min_width_m", min_width_m);
    visit("corridor_m", corridor_m);
    visit("vehicle_half_width_m", vehicle_half_width_m);
    visit("view_range_m", view_range_m);
    visit("min_angle_from_travel_rad", min_angle_from_travel_rad);
    visit("min_seen_points", min_seen_points);
    visit("grace_m", grace_m);
    visit("tolerance_m", tolerance_m);
    visit("false_radius_m", false_radius_m);
    visit("false_height_m", false_height_m);
    visit("false_range_m", false_range_m);
    visit("kerb_min_m", kerb_min_m);
    visit("kerb_max_m", kerb_max_m);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// One obstacle that was viewed and could be judged.
struct ObstacleOutcome {
  std::string kind;
  Eigen::Vector2d middle_m{0.0, 0.0};  ///< in the world
  double height_m = 0.0;
  double width_m = 0.0;
  double distance_m = 0.0;  ///< from the ground that is driven over
  bool reported = false;    ///< when it had to be
  uint64_t frames = 0;      ///< from then on in view
  uint64_t frames_reported = 0;
};

/// A cell of the map that was occupied where nothing is: each counts once, however often.
struct FalseCell {
  Eigen::Vector2d world_m{0.0, 0.0};  ///< when it was first occupied
  Timestamp first_seen;
  uint64_t frames = 0;      ///< in so many of the maps that were judged
  bool is_left = false;     ///< still, when the vehicle had left it behind
  bool is_on_open = false;  ///< a camera saw the ground there at some time of the drive
};

/// A place on the outline of a kerb that was viewed and could be judged.
struct KerbOutcome {
  Eigen::Vector2d place_m{0.0, 0.0};  ///< in the world
  double nearest_m = 0.0;             ///< of the vehicle's middle to it, from the first view on
  bool reported = false;              ///< when it had to be
  bool ever_reported = false;         ///< at any time of the drive within the view range
  double height_error_m = 0.0;        ///< absolute, when it had to be
};

struct ObstacleMapErrors {
  uint64_t num_frames = 0;
  double driven_m = 0.0;
  std::vector<ObstacleOutcome> obstacles;
  std::vector<FalseCell> false_cells;  ///< by place; the numbers below are of those on open ground
  uint64_t num_false_cells = 0;        ///< over the whole drive
  double false_cells_per_10_m = 0.0;
  uint64_t num_false_left = 0;       ///< of them, still occupied when the vehicle had left them behind
  uint64_t num_false_hidden = 0;     ///< others, on ground that no camera ever saw
  double false_cells_per_map = 0.0;  ///< on average at a time
  uint64_t num_observed_inside = 0;  ///< different cells inside true obstacles that were free or occupied
  uint64_t num_free_inside = 0;      ///< and those that were ever free
  uint64_t num_kerb_points = 0;      ///< places on outlines of kerbs, every 10 cm, that were viewed
  uint64_t num_kerb_reported = 0;
  ErrorDistribution kerb_height_error_m;  ///< absolute, of the reported ones
  std::vector<KerbOutcome> kerbs;         ///< the places
  uint64_t num_mover_frames = 0;          ///< images in which a moving thing was in view
  uint64_t num_mover_reported = 0;
  uint64_t num_mover_cells = 0;  ///< under them, over all these images
  uint64_t num_mover_free = 0;   ///< and those of them that were free
};

/// Collects the fused maps of one drive, in order of time, with what cameras saw at the same time.
class ObstacleMapEvaluator {
 public:
  /// path: the vehicle's true poses over the whole drive. The ground of the scene is level at z = 0.
  ObstacleMapEvaluator(const std::vector<TruthObstacle>& obstacles, const TruthHeights& heights,
                       const std::vector<RigidTransform>& path,
                       const ObstacleMapEvaluationOptions& options = {});

  /// movers: that are there now; earlier_movers: and that were up to a second before.
  void add(const ObstacleMap& map, const std::vector<SeenPoint>& points,
           const RigidTransform& world_from_vehicle, const std::vector<TruthObstacle>& movers,
           const std::vector<TruthObstacle>& earlier_movers);

  ObstacleMapErrors errors() const;

 private:
  struct Tracked {  // an obstacle, or a place on a kerb
    TruthObstacle obstacle;
    double distance_m = 0.0;
    std::optional<double> first_view_m;  // distance driven
    bool judged = false;
    ObstacleOutcome outcome;
  };
  struct KerbPoint {
    double height_m = 0.0;
    std::optional<double> first_view_m;
    bool judged = false;
    KerbOutcome outcome;
  };
  struct Frame;

  void addKerbPoints(const TruthObstacle& kerb, const cv::Mat& highest_m,
                     const std::vector<RigidTransform>& path);
  void judgeObstacles(const Frame& frame);
  void judgeKerbs(const Frame& frame);
  static std::optional<double> kerbHeightError(const Frame& frame, const KerbPoint& point);
  void judgeCells(const Frame& frame);
  void addFalseCell(const Frame& frame, int64_t key, const Eigen::Vector2d& place_m);
  void addFalseCellsTo(ObstacleMapErrors* errors) const;
  void judgeMovers(const Frame& frame);

  ObstacleMapEvaluationOptions options_;
  TruthHeights heights_;
  cv::Mat highest_around_, lowest_around_;
  std::vector<TruthObstacle> standing_;
  std::vector<Tracked> tracked_;
  std::vector<KerbPoint> kerb_points_;
  std::map<int64_t, FalseCell> false_cells_;  // by cell of the map's fixed frame
  SeenCells seen_ground_;
  std::set<int64_t> observed_inside_, free_inside_;
  std::optional<Eigen::Vector2d> last_position_m_;
  double driven_m_ = 0.0;
  uint64_t num_frames_ = 0, num_mover_frames_ = 0, num_mover_reported_ = 0, num_mover_cells_ = 0,
           num_mover_free_ = 0;
};

}  // namespace vcharge
