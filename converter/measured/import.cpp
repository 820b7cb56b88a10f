#include "converter/measured/import.h"

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <mutex>
#include <numbers>
#include <sstream>
#include <tuple>

#include "converter/measured/repeats.h"
#include "converter/measured/scattered.h"
#include "format/base/atomic_file.h"
#include "format/base/guard.h"
#include "format/base/memory.h"
#include "format/base/option_text.h"
#include "format/base/parallel.h"
#include "format/base/random.h"
#include "format/samples/samples.h"

namespace selvedge {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 8> columns{"file",   "light_x", "light_y", "light_z",
                                             "view_x", "view_y",  "view_z",  "exposure"};

/// Where pictures are listed, for messages: a table and its line, or a file whose name has the angles.
struct Listed {
  std::string file;
  std::string place = {};
  [[noreturn]] void refuse(std::string why) const {
    throw Failure{Error{Code::samples_malformed, file, place, std::move(why)}};
  }
};

V3f front_direction(const V3d& d, const char* what, const Listed& at) {
  const double length = d.length();
  if (!(std::isfinite(length) && length > 0))
    at.refuse(fmt::format("the direction of the {} has no length", what));
  const V3d unit = d / length;
  // As spec/samples.md has it of stored pairs, with room for the rounding of angles.
  if (!(unit.z > 1e-3)) at.refuse(fmt::format("the {} lies at or below the horizon", what));
  return V3f(unit);
}

/// One line of a table, whose columns `place` has.
MeasuredPicture picture_from(const std::vector<std::string>& fields, const std::vector<std::size_t>& column,
                             const Listed& at, int line) {
  std::array<double, columns.size()> number{};
  number.back() = 1;
  std::string file;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (column[i] == 0) {
      file = fields[i];
      continue;
    }
    const auto parsed = parse_numbers(fields[i], ',', 1, 1);
    if (!parsed) at.refuse(fmt::format("{} is no number: {}", columns[column[i]], fields[i]));
    number[column[i]] = parsed->front();
  }
  if (file.empty()) at.refuse("no file is named");
  if (!(number.back() > 0)) at.refuse("exposure is not above 0");
  const DirectionPair pair{front_direction({number[1], number[2], number[3]}, "light", at),
                           front_direction({number[4], number[5], number[6]}, "view", at)};
  return {(fs::path(at.file).parent_path() / file).string(), pair, number.back(), line};
}

std::vector<MeasuredPicture> read_table(const std::string& path) {
  const std::string text = value_or_throw(read_file(path, std::uintmax_t{1} << 26U));
  std::istringstream lines(text.starts_with("\xef\xbb\xbf") ? text.substr(3) : text);
  std::vector<MeasuredPicture> pictures;
  std::vector<std::size_t> column;  // of each field: index into `columns`
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos || line.front() == '#') continue;
    const Listed at{path, fmt::format("line {}", number)};
    std::erase(line, '\r');
    const auto fields = parts_of(line, ',');
    if (column.empty()) {
      for (const std::string& name : fields) {
        const auto found = std::ranges::find(columns, name);
        if (found == columns.end()) at.refuse("no column has the name " + name);
        column.push_back(found - columns.begin());
      }
      for (std::size_t c = 0; c < columns.size(); ++c) {
        const auto count = std::ranges::count(column, c);
        if (count > 1 || (count == 0 && c + 1 < columns.size()))
          at.refuse(fmt::format("{} columns have the name {}", count, columns[c]));
      }
      continue;
    }
    if (fields.size() != column.size())
      at.refuse(fmt::format("{} fields; the first line has {}", fields.size(), column.size()));
    pictures.push_back(picture_from(fields, column, at, number));
  }
  if (column.empty()) Listed{path, "line 1"}.refuse("there are no names of columns");
  return pictures;
}

/// The angle whose degrees follow the word `name` in a file's name.
std::optional<double> angle_in(const std::string& file, std::string_view name) {
  const auto is = [&](int (*kind)(int), std::size_t i) {
    return kind(static_cast<unsigned char>(file[i])) != 0;
  };
  for (std::size_t i = file.find(name); i != std::string::npos; i = file.find(name, i + 1)) {
    const std::size_t digits = i + name.size();
    double degrees = 0;
    if ((i == 0 || !is(std::isalpha, i - 1)) && is(std::isdigit, digits) &&
        std::from_chars(&file[digits], file.data() + file.size(), degrees, std::chars_format::fixed).ec ==
            std::errc())
      return degrees * std::numbers::pi / 180;
  }
  return std::nullopt;
}

std::vector<MeasuredPicture> read_names(const std::string& path) {
  std::vector<fs::path> files;
  std::error_code fault;
  for (fs::recursive_directory_iterator i(path, fault), end; !fault && i != end; i.increment(fault))
    if (i->is_regular_file()) files.push_back(i->path());
  if (fault) throw Failure{Error{Code::file_unreadable, path, {}, fault.message()}};
  std::ranges::sort(files);
  std::vector<MeasuredPicture> pictures;
  for (const fs::path& file : files) {
    const std::string name = file.filename().string();
    std::array<std::optional<double>, 4> angle;
    constexpr std::array<const char*, 4> names{"tl", "pl", "tv", "pv"};
    for (std::size_t i = 0; i < names.size(); ++i) angle[i] = angle_in(name, names[i]);
    if (!std::ranges::all_of(angle, [](const auto& a) { return a.has_value(); })) continue;
    const auto direction = [](double polar, double azimuth) {
      return V3d(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar));
    };
    const Listed at{file.string()};
    const DirectionPair pair{front_direction(direction(*angle[0], *angle[1]), "light", at),
                             front_direction(direction(*angle[2], *angle[3]), "view", at)};
    pictures.push_back({file.string(), pair, 1, 0});
  }
  if (pictures.empty()) Listed{path}.refuse("no file has a name with angles, as tl000_pl000_tv000_pv000.png");
  return pictures;
}

/// The pictures and their common size, period and texels.
struct FlatSample {
  std::string table;
  std::vector<MeasuredPicture> pictures;
  V2i size{0, 0};  ///< pixels
  V2d period{0, 0};
  V2i texels{0, 0};
  int texel_count() const { return texels.x * texels.y; }
};

[[noreturn]] void refuse_option(const char* option, std::string why) {
  throw Failure{Error{Code::option_out_of_range, {}, option, std::move(why)}};
}

/// Bytes of a pixel while its picture is read and averaged: as stored, as floats of a strip and as read, each
/// of four channels; then as read, and four sums.
constexpr std::uint64_t reading_price = 48;

/// A picture as radiance over the radiance of white, with `size`, unless that is 0.
Result<Image> read_picture(const MeasuredPicture& picture, const V2i& size, const ImportOptions& options) {
  auto image =
      read_image(picture.file, options.colours == PictureColours::srgb ? Transfer::srgb : Transfer::keep,
                 options.max_memory);
  if (!image) return image;
  if (size.x > 0 && size != V2i(image->width, image->height))
    return fail(Code::image_mismatch, picture.file, {},
                fmt::format("{} x {} pixels; the first picture has {} x {}", image->width, image->height,
                            size.x, size.y));
  const auto scale = static_cast<float>(1 / picture.exposure);
  for (std::size_t i = 0; i < image->pixels.size(); i += 4) {
    float* p = &image->pixels[i];
    if (!std::isfinite(p[0] + p[1] + p[2])) {
      const std::size_t pixel = i / 4;
      return fail(Code::image_unreadable, picture.file,
                  fmt::format("pixel {},{}", pixel % image->width, pixel / image->width), "is not finite");
    }
    V3f colour(p[0], p[1], p[2]);
    // IEC 61966-2-1.
    if (options.colours == PictureColours::xyz)
      colour = V3f(3.2406F * p[0] - 1.5372F * p[1] - 0.4986F * p[2],
                   -0.9689F * p[0] + 1.8758F * p[1] + 0.0415F * p[2],
                   0.0557F * p[0] - 0.2040F * p[1] + 1.0570F * p[2]);
    for (int c = 0; c < 3; ++c) p[c] = colour[c] * scale;
  }
  return image;
}

/// Takes `price` bytes for each pixel of a picture.
void take_pixels(MemoryBudget& budget, const FlatSample& sample, std::uint64_t price) {
  const V2i& size = sample.size;
  if (!budget.try_spend(std::uint64_t{1} * size.x * size.y, price))
    throw Failure{memory_limit_error(
        sample.table, "", fmt::format("its pictures of {} x {} pixels", size.x, size.y), budget.limit())};
}

/// The period in pixels: from the options, or found in the pictures that are seen and lit most steeply,
/// where neighbouring yarns hide least of each other.
V2d period_of(const FlatSample& sample, const ImportOptions& options) {
  constexpr std::size_t used = 16;
  const V2d size(sample.size);
  V2d period = options.period_mm.value_or(V2d(0, 0)) * (size.x / options.width_mm);
  if (!options.period_mm) {
    std::vector<const MeasuredPicture*> steepest;
    for (const MeasuredPicture& picture : sample.pictures) steepest.push_back(&picture);
    const auto height = [](const MeasuredPicture* p) {
      return std::min(p->pair.view.z, 0.8F) + p->pair.view.z;
    };
    std::ranges::stable_sort(steepest, [&](const auto* a, const auto* b) { return height(a) > height(b); });
    steepest.resize(std::min(steepest.size(), used));
    MemoryBudget budget(options.max_memory);
    take_pixels(budget, sample, steepest.size() * sizeof(float) + reading_price);
    std::vector<Image> pictures;
    for (const MeasuredPicture* picture : steepest)
      pictures.push_back(luminance_of(value_or_throw(read_picture(*picture, sample.size, options))));
    for (const int axis : {0, 1}) {
      const auto found = find_period(pictures, axis);
      if (!found)
        value_or_throw<void>(fail(
            Code::image_mismatch, sample.table, {},
            fmt::format("the pictures show no period along {}: give it (--period)", axis == 0 ? "x" : "y")));
      period[axis] = *found;
    }
  }
  constexpr double rounding = 1.01;
  for (const int axis : {0, 1}) {
    if (!(period[axis] >= 1 && period[axis] <= rounding * size[axis]))
      refuse_option("--period", fmt::format("{:.4g} pixels; a picture has {} along {}", period[axis],
                                            size[axis], axis == 0 ? "x" : "y"));
    period[axis] = std::min(period[axis], size[axis]);
  }
  return period;
}

/// The set of every picture: `measured`, but for those that the fit does not see.
std::vector<PairKind> sets_of(const std::vector<MeasuredPicture>& pictures, const ImportOptions& options) {
  // As for the random pairs of a bake: errors near the horizon would hide all others.
  constexpr float min_z = 0.15F;
  constexpr double held_out_fraction = 0.1;  // of all pictures, for validation and held-out pairs
  std::vector<std::size_t> free;
  for (std::size_t i = 0; i < pictures.size(); ++i)
    if (std::min(pictures[i].pair.light.z, pictures[i].pair.view.z) >= min_z) free.push_back(i);
  Random random(options.seed, 1);
  for (std::size_t i = free.size(); i > 1; --i) std::swap(free[i - 1], free[random.next() % i]);
  const auto count = std::min<std::size_t>(
      free.size(), std::lround(held_out_fraction * static_cast<double>(pictures.size())));
  std::vector<PairKind> sets(pictures.size(), PairKind::measured);
  for (std::size_t k = 0; k < count; ++k)
    sets[free[k]] = k % 2 == 0 ? PairKind::held_out : PairKind::validation;
  return sets;
}

/// The cells of all pictures: [picture][3 * texel + channel].
struct Cells {
  decltype(PairValues::values) values;
  double variance = 0;
  double mean_square = 0;
};

/// As many pictures at once as `memory` has room for.
Cells read_cells(const FlatSample& sample, const RepeatAverage& average, ImportOptions options,
                 MemoryBudget memory, const Progress& progress) {
  const std::uint64_t left = memory.unspent_bytes();
  take_pixels(memory, sample, reading_price);
  const auto at_once =
      static_cast<int>(std::min<std::uint64_t>(thread_count(), left / (left - memory.unspent_bytes())));
  options.max_memory = left / at_once;
  const auto count = static_cast<int>(sample.pictures.size());
  Cells cells;
  cells.values.resize(count, Eigen::Index{3} * sample.texel_count());
  std::vector<Result<RepeatAverage::Cell>> read(at_once, RepeatAverage::Cell{});
  for (int first = 0; first < count; first += at_once) {
    const int end = std::min(first + at_once, count);
    parallel_for(first, end, [&](int i) {
      const auto picture = read_picture(sample.pictures[i], sample.size, options);
      read[i - first] =
          picture ? Result<RepeatAverage::Cell>(average.average(*picture)) : tl::unexpected(picture.error());
    });
    for (int i = first; i < end; ++i) {
      const auto cell = value_or_throw(std::move(read[i - first]));
      for (int t = 0; t < sample.texel_count(); ++t)
        for (int c = 0; c < 3; ++c)
          cells.values(i, Eigen::Index{3} * t + c) = cell.values[t][c] * std::numbers::inv_pi_v<float>;
      cells.variance += cell.variance;
      cells.mean_square += cell.mean_square;
    }
    if (progress) progress(0.7 * end / count);
  }
  return cells;
}

template <class Row>
void append_row(const Row& row, std::vector<V3f>& radiance) {
  for (Eigen::Index i = 0; i < row.size(); i += 3)
    radiance.emplace_back(std::max(row(i), 0.0F), std::max(row(i + 1), 0.0F), std::max(row(i + 2), 0.0F));
}

/// The normal of each texel times its opacity, as the frames of the lobes need it: the normal of the
/// Lambertian surface which fits its pictures best (Woodham 1980).
std::vector<V3f> normals_of(const PairValues& known, const std::vector<float>& alpha) {
  Eigen::Matrix<float, Eigen::Dynamic, 3> lights(static_cast<Eigen::Index>(known.pairs.size()), 3);
  for (std::size_t i = 0; i < known.pairs.size(); ++i)
    for (int c = 0; c < 3; ++c) lights(static_cast<Eigen::Index>(i), c) = known.pairs[i].light[c];
  const Eigen::MatrixXf sums = lights.transpose() * known.values;
  const Eigen::Matrix3f gram = lights.transpose() * lights + 1e-3F * Eigen::Matrix3f::Identity();
  const Eigen::MatrixXf slopes = gram.ldlt().solve(sums);
  std::vector<V3f> normals;
  for (std::size_t t = 0; t < alpha.size(); ++t) {
    const Eigen::Vector3f sum = slopes.middleCols(static_cast<Eigen::Index>(3 * t), 3).rowwise().sum();
    const V3f normal(sum.x(), sum.y(), std::max(sum.z(), 0.0F));
    normals.push_back(normal.z > 0 ? normal.normalized() * alpha[t] : V3f(0, 0, alpha[t]));
  }
  return normals;
}

/// The interpolated samples of the grids, and the pairs of the pictures.
Samples samples_from(const SamplesHeader& header, const std::vector<float>& alpha, const FlatSample& sample,
                     const Cells& cells, const std::vector<PairKind>& sets, const PairValues& known,
                     const PairCovariance& kernel, const Progress& progress) {
  Samples samples;
  samples.header = header;
  const std::vector<V3f> views = cell_directions(header.views);
  const std::vector<V3f> lights = cell_directions(header.lights);
  const std::vector<V3f> normals = normals_of(known, alpha);
  samples.views.resize(views.size());
  std::mutex guard;
  double done = 0;
  parallel_for(0, header.views.count(), [&](int v) {
    std::vector<DirectionPair> pairs;
    for (const V3f& light : lights) pairs.push_back({light, views[v]});
    const Eigen::MatrixXf values = interpolate(known, kernel, pairs);
    ViewSamples& view = samples.views[v];
    view.alpha = alpha;
    view.normal = normals;
    for (Eigen::Index l = 0; l < values.rows(); ++l) append_row(values.row(l), view.radiance);
    const std::lock_guard lock(guard);
    done += 1;
    if (progress) progress(0.7 + 0.3 * done / header.views.count());
  });
  for (const PairKind kind : all_pair_kinds) {
    PairSamples& pairs = samples.pairs[index_of(kind)];
    pairs.width = header.width;
    pairs.height = header.height;
    for (std::size_t i = 0; i < sets.size(); ++i) {
      if (sets[i] != kind) continue;
      pairs.pairs.push_back(sample.pictures[i].pair);
      pairs.alpha.insert(pairs.alpha.end(), alpha.begin(), alpha.end());
      append_row(cells.values.row(static_cast<Eigen::Index>(i)), pairs.radiance);
    }
    // Not known: the repeats differ by more than noise.
    pairs.noise.assign(pairs.radiance.size(), V3f(0, 0, 0));
    pairs.alpha_noise.resize(pairs.alpha.size());
  }
  value_or_throw(round_to_half(samples));
  return samples;
}

std::string provenance_of(const ImportReport& report, const std::string& table) {
  nlohmann::json import{{"table", table},
                        {"pictures", report.picture_count},
                        {"heldOut", report.held_out_count},
                        {"repeats", {report.repeats.x, report.repeats.y}},
                        {"irregularity", report.repeat_deviation},
                        {"leftOutError", report.leave_one_out_error}};
  return nlohmann::json{{"import", import}}.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// The memory left beside the texels of the pictures.
MemoryBudget check_options(const ImportOptions& o, const FlatSample& sample) {
  MemoryBudget memory(o.max_memory);
  // All pictures, and those that the grids are interpolated from.
  if (!memory.try_spend(sample.pictures.size(), std::uint64_t{24} * sample.texel_count()))
    throw Failure{memory_limit_error(sample.table, "--texels",
                                     fmt::format("{} pictures of {} x {} texels", sample.pictures.size(),
                                                 sample.texels.x, sample.texels.y),
                                     o.max_memory)};
  const double pixels =
      sample.texel_count() * std::max(1.0 * o.views * o.lights, static_cast<double>(sample.pictures.size()));
  if (pixels > static_cast<double>(ExrLimits{}.pixels_per_part))
    refuse_option("--texels",
                  fmt::format("texels x views x lights, or pictures, are {:.3g}: too many", pixels));
  return memory;
}

Result<ImportReport> import_all(const std::string& table, const ImportOptions& options,
                                const std::string& output, const Progress& progress) {
  const Stopwatch watch;
  FlatSample sample{table, value_or_throw(read_picture_table(table))};
  {
    const Image first = value_or_throw(read_picture(sample.pictures.front(), V2i(0, 0), options));
    sample.size = V2i(first.width, first.height);
  }
  sample.period = period_of(sample, options);
  // Those of a bake, but no more than pixels.
  const auto fitting = [](double pixels) { return std::clamp(static_cast<int>(std::lround(pixels)), 1, 32); };
  sample.texels = options.texels.value_or(V2i(fitting(sample.period.x), fitting(sample.period.y)));
  MemoryBudget memory = check_options(options, sample);
  take_pixels(memory, sample, sizeof(float));  // opacity
  const auto opacity = [&] {
    ImportOptions as_it_is{.colours = PictureColours::linear, .max_memory = memory.unspent_bytes()};
    return options.opacity_path.empty()
               ? Image()
               : value_or_throw(read_picture({options.opacity_path, {}, 1, 0}, sample.size, as_it_is));
  };
  const RepeatAverage average(sample.size, sample.period, sample.texels, opacity());
  const Cells cells = read_cells(sample, average, options, memory, progress);

  ImportReport report{
      .picture_count = static_cast<int>(sample.pictures.size()),
      .texels = sample.texels,
      .period_mm = sample.period * (options.width_mm / sample.size.x),
      .repeats = average.repeats(),
      .repeat_deviation = cells.mean_square > 0 ? std::sqrt(cells.variance / cells.mean_square) : 0};
  const auto sets = sets_of(sample.pictures, options);
  PairValues known;
  SamplesHeader header;
  for (std::size_t i = 0; i < sets.size(); ++i)
    header.pairs[index_of(sets[i])].push_back(sample.pictures[i].pair);
  known.pairs = header.pairs[index_of(PairKind::measured)];
  report.held_out_count = report.picture_count - static_cast<int>(known.pairs.size());
  known.values.resize(static_cast<Eigen::Index>(known.pairs.size()), cells.values.cols());
  for (std::size_t i = 0, row = 0; i < sets.size(); ++i)
    if (sets[i] == PairKind::measured)
      known.values.row(static_cast<Eigen::Index>(row++)) = cells.values.row(static_cast<Eigen::Index>(i));
  const PairCovariance kernel = choose_covariance(known, options.seed);
  report.leave_one_out_error = kernel.leave_one_out_error;

  header.width = sample.texels.x;
  header.height = sample.texels.y;
  header.period_mm = V2f(report.period_mm);
  header.thickness_mm = header.reference_height = static_cast<float>(options.thickness_mm);
  header.views = nearly_square_grid(options.views);
  header.lights = nearly_square_grid(options.lights);
  header.samples_per_texel = header.truth_samples = 1;
  header.provenance = provenance_of(report, table);
  value_or_throw(write_samples(
      output, samples_from(header, average.alpha(), sample, cells, sets, known, kernel, progress)));
  report.seconds = watch.seconds();
  return report;
}

}  // namespace

Result<std::vector<MeasuredPicture>> read_picture_table(const std::string& path) {
  return catch_failure([&] {
    std::error_code fault;
    auto pictures = fs::is_directory(path, fault) ? read_names(path) : read_table(path);
    const auto place_of = [](const MeasuredPicture& p) {
      return p.table_line > 0 ? fmt::format("line {}", p.table_line) : p.file;
    };
    std::map<std::tuple<float, float, float, float, float, float>, const MeasuredPicture*> seen;
    for (const MeasuredPicture& p : pictures) {
      const Listed at{path, place_of(p)};
      if (!fs::exists(p.file, fault)) at.refuse(p.file + " does not exist");
      const V3f& l = p.pair.light;
      const V3f& v = p.pair.view;
      const auto [other, is_new] = seen.try_emplace({l.x, l.y, l.z, v.x, v.y, v.z}, &p);
      if (!is_new) at.refuse(fmt::format("has the directions of {}", place_of(*other->second)));
    }
    if (std::ssize(pictures) < min_pictures)
      Listed{path}.refuse(fmt::format("{} pictures; at least {} are needed", pictures.size(), min_pictures));
    return pictures;
  });
}

Result<ImportReport> import_pictures(const std::string& table, const ImportOptions& options,
                                     const std::string& output, const Progress& progress) {
  return catch_exceptions(table, [&] { return import_all(table, options, output, progress); });
}

}  // namespace selvedge
