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
#include "format/base/guard.h"
#include "format/base/vec.h"
#include "format/gltf/edit.h"

namespace selvedge {
namespace {

/// Meaning of a word in the name of a material.
enum class Says {
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
constexpr std::array<std::pair<Says, std::string_view>, 14> table{
    {{Says::fabric,
      "fabric cloth clothes clothing textile cotton denim silk satin velvet wool linen canvas jersey knit "
      "tweed fleece flannel nylon polyester chiffon tulle corduroy cashmere twill lace crochet stoff tissu "
      "tela tessuto 布 服 衣 裙 裤"},
     {Says::garment,
      "shirt tshirt tee blouse jacket coat dress gown skirt pant pants trouser jean shorts sweater hoodie "
      "jumper cardigan vest suit uniform robe kimono scarf shawl glove sock stocking legging tights "
      "underwear bra bikini swimsuit corset apron cape cloak hood hat beanie tie outfit garment costume "
      "sleeve collar cuff pocket lining band warmer mask hemd jacke kleid bluse chemise jupe veste pantalon "
      "camisa vestido falda camicia gonna giacca"},
     {Says::furnishing,
      "sofa couch armchair curtain drape cushion pillow blanket quilt duvet bedding mattress carpet rug "
      "towel tablecloth upholstery tapestry vorhang kissen rideau coussin cortina"},
     {Says::skin,
      "skin hair eye eyelash lash eyebrow brow eyeball cornea iris sclera pupil tooth teeth tongue mouth "
      "nail fingernail toenail beard moustache mustache scalp haut haar haare auge augen zahn zähne peau "
      "cheveux yeux dents piel pelo cabello ojo pelle capelli occhi denti 肌 皮肤 髪 头发 目 眼 歯 牙 眉"},
     {Says::hardware,
      "button buttonhole zip zipper sole buckle rivet eyelet hook snap lens mirror backing chain jewel "
      "diamond metal chrome glass plastic wood wooden rubber rail rod bracket hinge screw bolt mannequin "
      "manikin hanger sunglasses goggles knopf metall glas holz kunststoff bouton métal verre bois plastique "
      "botón vidrio madera plástico bottone metallo vetro legno plastica"},
     {Says::other,
      "steel iron brass bronze gold silver pearl copper aluminium aluminum oak walnut stone marble brick "
      "concrete crystal ceramic porcelain plaster tile wall floor ceiling roof window door stair frame stand "
      "table shelf cabinet"},
     {Says::other,
      "lamp bulb lantern chandelier candle screen monitor display tv television text logo decal paint "
      "painting picture poster book paper pipe faucet sink toilet soil dirt ground gravel grass plant leaf "
      "leaves foliage tree bark branch flower petal pot vase water wheel tire tyre"},
     {Says::other,
      "lampe lampada lámpara wand boden fenster pflanze blatt erde rohr bildschirm mur plante feuille tuyau "
      "peinture écran pared suelo planta hoja tierra pintura pantalla"},
     {Says::other, "wolf avaturn"},  // Ready Player Me's Wolf3D_Head, Avaturn's avaturn_look
     {Says::body,
      "body head face hand arm torso neck finger thumb toe ear lip nose körper kopf gesicht corps visage "
      "tête cuerpo cabeza cara corpo testa viso 体 顔 脸"},
     {Says::leg, "leg foot feet"},
     {Says::person, "male female man woman boy girl human person avatar character"}}};

struct Hit {
  std::size_t at;  ///< byte of the name behind the word
  Says says;
  std::string word;
};

/// The known words of a name, in their order. Words end where letters do, and before a capital letter after a
/// small one or before two (TVScreen); Chinese and Japanese ones may stand anywhere.
std::vector<Hit> hits_in(const std::string& name) {
  static const std::map<std::string_view, Says> known = [] {
    std::map<std::string_view, Says> words;
    for (auto [says, list] : table) {
      while (!list.empty()) {
        const std::size_t end = std::min(list.find(' '), list.size());
        words.emplace(list.substr(0, end), says);
        list.remove_prefix(std::min(end + 1, list.size()));
      }
    }
    return words;
  }();
  const auto at = [&](std::size_t i) { return static_cast<unsigned char>(i < name.size() ? name[i] : ' '); };
  const auto is_letter = [](unsigned char c) { return std::isalpha(c) != 0 || c >= 0x80; };
  std::vector<Hit> hits;
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
        hits.push_back({i, found->second, word});
        break;
      }
      word.clear();
    }
    if (is_letter(letter)) word += static_cast<char>(std::tolower(letter));
  }
  for (const auto& [symbol, says] : known) {
    if (static_cast<unsigned char>(symbol.front()) < 0xE3) continue;  // UTF-8 of the first of these scripts
    const std::size_t found = name.rfind(symbol);
    if (found != std::string::npos && symbol != name) hits.push_back({found, says, std::string(symbol)});
  }
  std::ranges::stable_sort(hits, {}, &Hit::at);
  return hits;
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
};

Verdict verdict_on(const std::string& name, const Context& context) {
  const std::vector<Hit> hits = hits_in(name);
  const auto first = [&](auto... wanted) -> std::string {
    const auto hit = std::ranges::find_if(hits, [&](const Hit& h) { return ((h.says == wanted) || ...); });
    return hit == hits.end() ? "" : hit->word;
  };
  Verdict verdict;
  bool furnishing = false;
  for (const Hit& hit : hits) {
    furnishing |= hit.says == Says::furnishing;
    if (hit.says <= Says::furnishing) verdict = {true, ""};
    if (hit.says == Says::skin || hit.says == Says::hardware || (hit.says == Says::leg && furnishing))
      verdict = {false, hit.word};
  }
  if (verdict.cloth || !verdict.other.empty()) return verdict;
  verdict.other = first(Says::other);
  const bool skin = context.has_skin || !first(Says::person).empty();
  if (verdict.other.empty() && skin) verdict.other = first(Says::body, Says::leg);
  if (verdict.other.empty() && context.has_fabric) verdict.other = first(Says::leg);
  return verdict;
}

/// Why the factors of a material are not cloth's; empty where they may be. A metallic factor beside a
/// texture, or without a roughness that polishes it, says nothing: programs forget to write 0.
std::string no_cloth_factors(const Json& material) {
  if (number_of(
          member(member(member(material, "extensions"), "KHR_materials_transmission"), "transmissionFactor"),
          0) > 0.5)
    return "light passes through it as through glass";
  const Json& core = member(material, "pbrMetallicRoughness");
  if (member(core, "metallicRoughnessTexture").is_null() &&
      number_of(member(core, "metallicFactor"), 0) > 0.5 &&
      number_of(member(core, "roughnessFactor"), 1) < 0.5)
    return "it is polished metal";
  return "";
}

class Chooser {
 public:
  explicit Chooser(GltfDocument& document) : document_(document) {}

  ChosenMaterials choose(const MaterialChoice& choice) {
    std::set<int> chosen;
    ChosenMaterials result;
    if (choice.all) chosen = find_cloth(result.left_alone);
    for (const std::string& selector : choice.materials) chosen.merge(find(selector));
    for (const std::string& selector : choice.except) {
      for (const int material : find(selector)) chosen.erase(material);
    }
    if (chosen.empty()) {
      throw Failure{Error{Code::material_missing, document_.file, "/materials",
                          !result.left_alone.empty() ? fmt::format("{}", fmt::join(result.left_alone, "; "))
                          : !choice.except.empty()   ? "all materials are left alone"
                          : choice.all               ? "there are no triangles to dress"
                                                     : "no material is named"}};
    }
    result.materials.assign(chosen.begin(), chosen.end());
    return result;
  }

 private:
  const Json& materials() const { return array_of(document_.json, "materials"); }
  int count() const { return static_cast<int>(materials().size()); }
  static std::string name_of(const Json& entry) { return string_of(member(entry, "name")); }
  std::string name_of(int material) const { return name_of(materials()[material]); }

  /// The materials that may be cloth, and a line for each that is not.
  std::set<int> find_cloth(std::vector<std::string>& left_alone) {
    add_missing_material();
    const Uses uses = uses_of(document_.json);
    const Context context = context_of_names();
    read_nodes();
    std::set<int> worn;
    std::map<int, std::string> reasons;
    std::set<int> by_places;
    for (int i = 0; i < count(); ++i) {
      if (uses.contains(i)) worn.insert(i);
    }
    for (int i = 0; i < count(); ++i) {
      if (worn == std::set<int>{i}) continue;
      Verdict verdict = verdict_on(name_of(i), context);
      if (verdict.cloth) continue;
      if (verdict.other.empty()) reasons[i] = no_cloth_factors(materials()[i]);
      if (verdict.other.empty() && reasons[i].empty() && worn.contains(i)) {
        for (const Place& place : uses.at(i)) {
          verdict = verdict_at(place, context);
          if (verdict.other.empty()) break;
        }
        if (!verdict.other.empty()) by_places.insert(i);
        if (verdict.other.empty() && !verdict.cloth && moves_as_body(uses.at(i)))
          reasons[i] = "it moves with head and fingers, as a body does";
      }
      if (!verdict.other.empty()) reasons[i] = fmt::format("a \"{}\" is no cloth", verdict.other);
      if (reasons[i].empty()) reasons.erase(i);
    }
    if (std::ranges::all_of(worn, [&](int i) { return reasons.contains(i); })) {
      for (const int i : by_places) reasons.erase(i);
    }
    std::set<int> cloth;
    for (int i = 0; i < count(); ++i) {
      if (const auto reason = reasons.find(i); reason == reasons.end())
        cloth.insert(i);
      else
        left_alone.push_back(
            fmt::format("material #{} \"{}\" was left alone: {}; --material '#{}' dresses it", i, name_of(i),
                        reason->second, i));
    }
    return cloth;
  }

  Context context_of_names() const {
    Context context;
    for (const char* list : {"materials", "meshes"}) {
      for (const Json& entry : array_of(document_.json, list)) {
        for (const Hit& hit : hits_in(name_of(entry))) {
          context.has_skin |= hit.says == Says::skin;
          context.has_fabric |= hit.says == Says::furnishing || hit.says == Says::fabric;
        }
      }
    }
    return context;
  }

  /// The names of each mesh, of the nodes that show it and of their parents; and its skin.
  void read_nodes() {
    constexpr std::size_t max_names = 16;
    const Json& nodes = array_of(document_.json, "nodes");
    std::map<int, std::string> above;
    for (const Json& node : nodes)
      for (const Json& child : array_of(node, "children")) above[index_of(child)] = name_of(node);
    for (std::size_t m = 0; m < array_of(document_.json, "meshes").size(); ++m)
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

  Verdict verdict_at(const Place& place, const Context& context) {
    for (const std::string& name : names_[place.first]) {
      if (Verdict verdict = verdict_on(name, context); verdict.cloth || !verdict.other.empty())
        return verdict;
    }
    return {};
  }

  /// Whether vertices follow joints of the head and others joints of fingers: clothes are skinned, too, but
  /// have either at most.
  bool moves_as_body(const std::set<Place>& places) {
    std::set<std::string> followed;  // words of joints
    for (const Place& place : places) {
      const Json& joints = array_of(entry_of(document_, "skins", skins_[place.first]), "joints");
      const Json& attributes = member(primitive_at(document_, place), "attributes");
      std::set<int> numbers;
      (void)result_of([&] {  // faults are found later
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
        for (const Hit& hit : hits_in(name_of(entry_of(document_, "nodes", index_of(joints[joint])))))
          followed.insert(hit.word);
      }
      if (weighted_ > max_weighted) break;
    }
    const auto any = [&](std::initializer_list<const char*> words) {
      return std::ranges::any_of(words, [&](const char* word) { return followed.contains(word); });
    };
    return any({"head", "eye", "face"}) && any({"finger", "thumb"});
  }

  /// Triangles without a material get a new one.
  void add_missing_material() {
    const Uses uses = uses_of(document_.json);
    const auto bare = uses.find(-1);
    if (bare == uses.end()) return;
    std::vector<Place> places(bare->second.begin(), bare->second.end());
    std::erase_if(places, [&](const Place& place) {
      return !member(primitive_at(document_, place), "material").is_null();  // present, but not an index
    });
    if (places.empty()) return;
    document_.json["materials"].push_back(Json{{"name", "fabric"}});
    for (const Place& place : places)
      primitive_at(document_, place)["material"] = document_.json["materials"].size() - 1;
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
  GltfDocument& document_;
  std::map<int, std::vector<std::string>> names_;  ///< by mesh
  std::map<int, int> skins_;                       ///< by mesh
  std::size_t weighted_ = 0;
};

}  // namespace

Result<ChosenMaterials> choose_materials(GltfDocument& document, const MaterialChoice& choice) {
  return result_of([&] { return Chooser(document).choose(choice); });
}

}  // namespace selvedge
