#include "converter/dress/choose_materials.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <initializer_list>
#include <map>
#include <set>
#include <string_view>

#include "converter/dress/fabric_source.h"
#include "converter/dress/uv_scale.h"
#include "format/base/guard.h"
#include "format/base/vec.h"

namespace selvedge {
namespace {

/// Meaning of a word in the name of a material.
enum class WordClass {
  fabric,  ///< this to `furnishing`: cloth, unless a word of skin or hardware follows (shirt button)
  garment,
  furnishing,
  skin,
  hardware,
  other,  ///< no cloth, unless beside a word of cloth: cloth may be golden, or have leaves on it
  body,   ///< a part of a body beside skin; alone, a body may be a bodice
  leg,    ///< the same, and of furniture beside furnishings and fabrics
  person  ///< makes `body` a part of a body in the same name
};

/// Words in the singular, also German, French, Spanish, Italian, Chinese and Japanese.
constexpr std::array<std::pair<WordClass, std::string_view>, 14> table{
    {{WordClass::fabric,
      "fabric cloth clothes clothing textile cotton denim silk satin velvet wool linen canvas jersey knit "
      "tweed fleece flannel nylon polyester chiffon tulle corduroy cashmere twill lace crochet stoff tissu "
      "tela tessuto 布 服 衣 衫 裙 裤 袜"},
     {WordClass::garment,
      "shirt tshirt tee blouse jacket coat dress gown skirt pant pants trouser jean shorts sweater hoodie "
      "jumper cardigan vest suit uniform robe kimono scarf shawl glove sock stocking legging tights "
      "underwear bra bikini swimsuit corset apron cape cloak hood hat beanie tie outfit garment costume "
      "sleeve collar cuff pocket lining band warmer mask hemd jacke kleid bluse chemise jupe veste pantalon "
      "camisa vestido falda camicia gonna giacca"},
     {WordClass::furnishing,
      "sofa couch armchair curtain drape cushion pillow blanket quilt duvet bedding mattress carpet rug "
      "towel tablecloth upholstery tapestry vorhang kissen rideau coussin cortina"},
     {WordClass::skin,
      "skin hair eye eyelash lash eyebrow brow eyeball cornea iris sclera pupil tooth teeth tongue mouth "
      "nail fingernail toenail beard moustache mustache scalp haut haar haare auge augen zahn zähne braue "
      "brauen augenbraue augenbrauen wimper wimpern peau cheveux yeux dents sourcil cil piel pelo cabello "
      "ojo ceja pestaña pelle capelli occhi denti sopracciglia ciglia 肌 皮肤 髪 头发 目 眼 歯 牙 眉 睫"},
     {WordClass::hardware,
      "button buttonhole zip zipper sole buckle rivet eyelet hook snap lens mirror backing chain jewel "
      "diamond metal chrome glass plastic wood wooden rubber rail rod bracket hinge screw bolt mannequin "
      "manikin hanger visor eyewear eyeglass spectacles sunglasses goggles helmet knopf knöpfe visier brille "
      "metall glas holz kunststoff bouton visière lunettes métal verre bois plastique botón botones visera "
      "gafas vidrio madera plástico bottone bottoni visiera occhiali metallo vetro legno plastica 扣 釦 钮 "
      "鈕 拉链 ボタン 镜 鏡"},
     {WordClass::other,
      "steel iron brass bronze gold silver pearl copper aluminium aluminum oak walnut stone marble brick "
      "concrete crystal ceramic porcelain plaster tile wall floor ceiling backdrop background cyclorama roof "
      "window door stair frame stand table shelf cabinet"},
     {WordClass::other,
      "lamp bulb lantern chandelier candle screen monitor display tv television text logo decal paint "
      "painting picture poster book paper pipe faucet sink toilet soil dirt ground gravel grass plant leaf "
      "leaves foliage tree bark branch flower petal pot vase water wheel tire tyre"},
     {WordClass::other,
      "lampe lampada lámpara wand boden fenster pflanze blatt erde rohr bildschirm mur plante feuille tuyau "
      "peinture écran pared suelo planta hoja tierra pintura pantalla"},
     {WordClass::other, "wolf avaturn"},  // Ready Player Me's Wolf3D_Head, Avaturn's avaturn_look
     {WordClass::body,
      "body head face hand arm torso neck finger thumb toe ear lip nose körper kopf gesicht corps visage "
      "tête cuerpo cabeza cara corpo testa viso 体 顔 脸"},
     {WordClass::leg, "leg foot feet"},
     {WordClass::person, "male female man woman boy girl human person avatar character"}}};

struct WordMatch {
  std::size_t end;  ///< byte of the name behind the word
  WordClass kind;
  std::string word;
};

/// The known words of a name, in their order. Words end where letters do, and before a capital letter after a
/// small one or before two (TVScreen); Chinese and Japanese ones may stand anywhere.
std::vector<WordMatch> words_in(const std::string& name) {
  static const std::map<std::string_view, WordClass> known = [] {
    std::map<std::string_view, WordClass> words;
    for (auto [kind, list] : table) {
      while (!list.empty()) {
        const std::size_t end = std::min(list.find(' '), list.size());
        words.emplace(list.substr(0, end), kind);
        list.remove_prefix(std::min(end + 1, list.size()));
      }
    }
    return words;
  }();
  const auto at = [&](std::size_t i) { return static_cast<unsigned char>(i < name.size() ? name[i] : ' '); };
  const auto is_letter = [](unsigned char c) { return std::isalpha(c) != 0 || c >= 0x80; };
  std::vector<WordMatch> matches;
  std::string word;
  for (std::size_t i = 0; i <= name.size(); ++i) {
    const unsigned char letter = at(i);
    const bool starts =
        i > 0 && std::isupper(letter) != 0 &&
        (std::islower(at(i - 1)) != 0 || (std::islower(at(i + 1)) != 0 && std::islower(at(i + 2)) != 0));
    if (!is_letter(letter) || starts) {
      for (const std::string_view plural : {"", "s", "es"}) {
        if (!word.ends_with(plural)) continue;
        const auto found = known.find(std::string_view(word).substr(0, word.size() - plural.size()));
        if (found == known.end()) continue;
        matches.push_back({i, found->second, word});
        break;
      }
      word.clear();
    }
    if (is_letter(letter)) word += static_cast<char>(std::tolower(letter));
  }
  // UTF-8 of the first of the scripts without spaces; few names have a letter of them.
  const auto is_symbol = [](char c) { return static_cast<unsigned char>(c) >= 0xE3; };
  const bool has_symbols = std::ranges::any_of(name, is_symbol);
  for (const auto& [symbol, kind] : known) {
    if (!has_symbols) break;
    if (!is_symbol(symbol.front())) continue;
    const std::size_t found = name.rfind(symbol);
    if (found != std::string::npos && symbol != name) matches.push_back({found, kind, std::string(symbol)});
  }
  std::ranges::stable_sort(matches, {}, &WordMatch::end);
  return matches;
}

/// Properties of all names of a document.
struct Context {
  bool has_skin = false;
  bool has_fabric = false;  ///< beside which legs are furniture's
};

/// Verdict of a name: cloth, or not by this word; neither if the name says nothing.
struct Verdict {
  bool cloth = false;
  std::string other = {};
  bool says_nothing() const { return !cloth && other.empty(); }
};

Verdict verdict_on(const std::string& name, const Context& context) {
  const std::vector<WordMatch> matches = words_in(name);
  const auto first = [&](auto... wanted) -> std::string {
    const auto match =
        std::ranges::find_if(matches, [&](const WordMatch& m) { return ((m.kind == wanted) || ...); });
    return match == matches.end() ? "" : match->word;
  };
  Verdict verdict;
  bool furnishing = false;
  for (const WordMatch& match : matches) {
    furnishing |= match.kind == WordClass::furnishing;
    if (match.kind <= WordClass::furnishing) verdict = {true, ""};
    if (match.kind == WordClass::skin || match.kind == WordClass::hardware ||
        (match.kind == WordClass::leg && furnishing))
      verdict = {false, match.word};
  }
  if (!verdict.says_nothing()) return verdict;
  verdict.other = first(WordClass::other);
  const bool skin = context.has_skin || !first(WordClass::person).empty();
  if (verdict.other.empty() && skin) verdict.other = first(WordClass::body, WordClass::leg);
  if (verdict.other.empty() && context.has_fabric) verdict.other = first(WordClass::leg);
  return verdict;
}

/// Why the factors of a material are not cloth's; empty where they may be. A metallic factor beside a
/// texture, or without a roughness that polishes it, says nothing: programs forget to write 0.
std::string no_cloth_factors(const Json& material) {
  if (number_or(
          member(member(member(material, "extensions"), "KHR_materials_transmission"), "transmissionFactor"),
          0) > 0.5)
    return "light passes through it as through glass";
  const Json& core = member(material, "pbrMetallicRoughness");
  if (member(core, "metallicRoughnessTexture").is_null() &&
      number_or(member(core, "metallicFactor"), 0) > 0.5 &&
      number_or(member(core, "roughnessFactor"), 1) < 0.5)
    return "it is polished metal";
  return "";
}

class Chooser {
 public:
  Chooser(const GltfDocument& document, const Scene& scene)
      : document_(document), uses_(find_material_uses(document.json)), extents_(material_extents(scene)) {
    std::set<PrimitiveIndex> shown;
    for (const ScenePrimitive& p : scene.primitives) shown.emplace(p.mesh, p.primitive_index);
    for (const auto& [material, places] : uses_)
      if (shown.empty() ||
          std::ranges::any_of(places, [&](const PrimitiveIndex& place) { return shown.contains(place); }))
        worn_.insert(material);
  }

  ChosenMaterials choose(const MaterialChoice& choice) {
    std::set<int> chosen;
    ChosenMaterials result;
    if (choice.all_cloth) chosen = find_cloth(result.skipped_materials);
    for (const std::string& selector : choice.materials) chosen.merge(find(selector));
    for (const std::string& selector : choice.excluded_materials)
      for (const int material : find(selector)) chosen.erase(material);
    if (chosen.empty())
      throw Failure{Error{Code::material_missing, document_.file, "/materials",
                          !result.skipped_materials.empty()
                              ? fmt::format("nothing is cloth: {}", fmt::join(result.skipped_materials, "; "))
                          : !choice.excluded_materials.empty() ? "all materials are left alone"
                          : choice.all_cloth                   ? "there are no triangles to dress"
                                                               : "no material is named"}};
    result.materials.assign(chosen.begin(), chosen.end());
    return result;
  }

 private:
  const Json& materials() const { return array_member(document_.json, "materials"); }
  int count() const { return static_cast<int>(materials().size()); }
  static std::string name_of(const Json& entry) { return string_of(member(entry, "name")); }
  std::string name_of(int material) const { return name_of(materials()[material]); }

  /// The materials that may be cloth, and a line for each that is not.
  std::set<int> find_cloth(std::vector<std::string>& left_alone) {
    const Context context = context_of_names();
    read_nodes();
    std::set<int> by_places, named_cloth, nameless;
    for (int i = 0; i < count(); ++i) {
      if (worn_ == std::set<int>{i}) continue;
      Verdict verdict = verdict_on(name_of(i), context);
      std::string reason;
      if (verdict.says_nothing()) reason = no_cloth_factors(materials()[i]);
      if (verdict.says_nothing() && reason.empty() && worn_.contains(i)) {
        for (const PrimitiveIndex& place : uses_.at(i)) {
          verdict = {};
          for (const std::string& name : names_[place.first])
            if (verdict.says_nothing()) verdict = verdict_on(name, context);
          if (verdict.other.empty()) break;
        }
        if (!verdict.other.empty()) by_places.insert(i);
        if (verdict.says_nothing()) nameless.insert(i);
      }
      if (verdict.cloth) named_cloth.insert(i);
      if (!verdict.other.empty()) reason = fmt::format("a \"{}\" is no cloth", verdict.other);
      if (!reason.empty()) reasons_[i] = reason;
    }
    // A garment may have meshes that are called hair; brows and lashes are no garment.
    if (std::ranges::all_of(worn_, [&](int i) { return reasons_.contains(i); }) &&
        area_of(by_places) >= 0.5 * area_of(worn_) &&
        std::ranges::all_of(by_places, [&](int i) { return reasons_[i] == reasons_[*by_places.begin()]; }))
      for (const int i : by_places) reasons_.erase(i);
    leave_walls(nameless, named_cloth);
    leave_bodies(nameless);
    std::set<int> cloth;
    for (int i = 0; i < count(); ++i) {
      if (const auto reason = reasons_.find(i); reason == reasons_.end())
        cloth.insert(i);
      else
        left_alone.push_back(
            fmt::format("material #{} \"{}\" was left alone: {}; --material '#{}' dresses it", i, name_of(i),
                        reason->second, i));
    }
    return cloth;
  }

  double area_of(const std::set<int>& materials) {
    double sum = 0;
    for (const int i : materials) sum += extents_[i].twice_area;
    return sum;
  }

  /// Leaves flat rectangles alone for which the rest is small, but for mere labels without a name.
  void leave_walls(const std::set<int>& nameless, const std::set<int>& named_cloth) {
    constexpr double min_size = 1.5;   // of the rest's diagonal
    constexpr double min_area = 0.05;  // of the rest, in theirs
    MaterialExtent rest;
    for (const int i : worn_) {
      if (reasons_.contains(i) || (extents_[i].is_flat_rectangle && !named_cloth.contains(i))) continue;
      rest.box.extendBy(extents_[i].box);
      rest.twice_area += extents_[i].twice_area;
    }
    for (const int i : nameless) {
      const auto& [area, box, is_flat_rectangle] = extents_[i];
      if (rest.twice_area > (named_cloth.empty() ? min_area * area : 0) && is_flat_rectangle &&
          box.size().length() > min_size * rest.box.size().length())
        reasons_[i] = "it is a flat rectangle, much larger than the rest";
    }
  }

  /// Leaves bodies alone that wear clothes: a dressed figure of one material moves as a body does.
  void leave_bodies(const std::set<int>& nameless) {
    constexpr double min_clothes = 0.2;  // of the area
    std::set<int> figure, bodies;
    for (const int i : worn_) {
      if (reasons_.contains(i)) continue;
      figure.insert(i);
      if (nameless.contains(i) && moves_as_body(uses_.at(i))) bodies.insert(i);
    }
    if (area_of(bodies) > (1 - min_clothes) * area_of(figure)) return;
    for (const int i : bodies) reasons_[i] = "it moves with head and fingers, as a body does";
  }

  Context context_of_names() const {
    Context context;
    for (const char* list : {"materials", "meshes"}) {
      for (const Json& entry : array_member(document_.json, list)) {
        for (const WordMatch& match : words_in(name_of(entry))) {
          context.has_skin |= match.kind == WordClass::skin;
          context.has_fabric |= match.kind == WordClass::furnishing || match.kind == WordClass::fabric;
        }
      }
    }
    return context;
  }

  /// The names of each mesh, of the nodes that show it and of their parents; and its skin.
  void read_nodes() {
    constexpr std::size_t max_names = 16;
    const Json& nodes = array_member(document_.json, "nodes");
    std::map<int, std::string> above;
    for (const Json& node : nodes)
      for (const Json& child : array_member(node, "children")) above[index_of(child)] = name_of(node);
    for (std::size_t m = 0; m < array_member(document_.json, "meshes").size(); ++m)
      names_[static_cast<int>(m)].push_back(name_of(document_.json["meshes"][m]));
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      const int mesh = index_of(member(nodes[n], "mesh"));
      std::vector<std::string>& names = names_[mesh];
      if (mesh < 0 || names.size() > max_names) continue;
      names.push_back(name_of(nodes[n]));
      names.push_back(above[static_cast<int>(n)]);
      skins_[mesh] = index_of(member(nodes[n], "skin"));
    }
  }

  /// Whether vertices follow joints of the head and others joints of fingers: clothes are skinned, too, but
  /// have either at most.
  bool moves_as_body(const std::set<PrimitiveIndex>& places) {
    std::set<std::string> followed;  // words of joints
    for (const PrimitiveIndex& place : places) {
      const Json& joints = array_member(root_entry(document_, "skins", skins_[place.first]), "joints");
      const Json& attributes =
          member(document_.json["meshes"][place.first]["primitives"][place.second], "attributes");
      std::set<int> numbers;
      (void)catch_failure([&] {  // faults are found later
        GltfReader reader(document_);
        const auto joint = reader.attribute<V4f>(attributes, "JOINTS_0", 0, "");
        const auto weight = reader.attribute<V4f>(attributes, "WEIGHTS_0", joint.size(), "");
        if ((weighted_ += weight.size()) > max_weighted) return;
        for (std::size_t v = 0; v < weight.size(); ++v)
          for (int c = 0; c < 4; ++c)
            if (weight[v][c] > 0.5) numbers.insert(static_cast<int>(joint[v][c]));
      });
      for (const int joint : numbers) {
        if (joint < 0 || static_cast<std::size_t>(joint) >= joints.size()) continue;
        for (const WordMatch& match :
             words_in(name_of(root_entry(document_, "nodes", index_of(joints[joint])))))
          followed.insert(match.word);
      }
      if (weighted_ > max_weighted) break;
    }
    const auto any = [&](std::initializer_list<const char*> words) {
      return std::ranges::any_of(words, [&](const char* word) { return followed.contains(word); });
    };
    return any({"head", "eye", "face"}) && any({"finger", "thumb"});
  }

  std::set<int> find(const std::string& selector) const {
    int number = -1;
    if (selector.starts_with('#')) {
      const char* end = selector.data() + selector.size();
      if (std::from_chars(selector.data() + 1, end, number).ptr != end) number = -1;
    }
    std::set<int> found;
    if (number >= 0 && number < count()) found.insert(number);
    std::vector<std::string> names;
    for (int i = 0; i < count(); ++i) {
      if (name_of(i) == selector) found.insert(i);
      names.push_back(fmt::format("#{} \"{}\"", i, name_of(i)));
    }
    if (!found.empty()) return found;
    throw Failure{Error{Code::material_missing, document_.file, "/materials",
                        fmt::format("no material \"{}\"; there are: {}", selector,
                                    names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")))}};
  }

  static constexpr std::size_t max_weighted = 1U << 22U;  ///< vertices whose weights are read
  const GltfDocument& document_;
  const MaterialUses uses_;
  std::map<int, MaterialExtent> extents_;
  std::set<int> worn_;                             ///< materials that the scene shows
  std::map<int, std::string> reasons_;             ///< why materials are no cloth
  std::map<int, std::vector<std::string>> names_;  ///< by mesh
  std::map<int, int> skins_;                       ///< by mesh
  std::size_t weighted_ = 0;
};

}  // namespace

void add_missing_material(GltfDocument& document) {
  const MaterialUses uses = find_material_uses(document.json);
  const auto bare = uses.find(-1);
  if (bare == uses.end()) return;
  std::vector<PrimitiveIndex> places(bare->second.begin(), bare->second.end());
  std::erase_if(places, [&](const PrimitiveIndex& place) {
    return !member(primitive_at(document, place), "material").is_null();  // present, but not an index
  });
  if (places.empty()) return;
  document.json["materials"].push_back(Json{{"name", "fabric"}});
  for (const PrimitiveIndex& place : places)
    primitive_at(document, place)["material"] = document.json["materials"].size() - 1;
}

Result<ChosenMaterials> choose_materials(const GltfDocument& document, const Scene& scene,
                                         const MaterialChoice& choice) {
  return catch_failure([&] { return Chooser(document, scene).choose(choice); });
}

}  // namespace selvedge
