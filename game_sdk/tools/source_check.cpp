#include "game_sdk/tools/source_check.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "game_sdk/api/api.h"
#include "game_sdk/lua/spelling.h"
#include "game_sdk/tools/known_names.h"

namespace tessera::game {
namespace {

using NameSet = std::set<std::string, std::less<>>;

struct Variable {
  int depth = 0;      // functions around it; 0: of the file
  bool body = false;  // holds a body
};

std::string Quote(std::string_view name) { return absl::StrCat("`", std::string(name), "`"); }

// Two walks over the tree: the first one learns which names the file defines, the second one finds faults.
class SourceWalk {
 public:
  explicit SourceWalk(const Scene& scene) : scene_(scene), known_(NamesOfSandbox()) {}

  std::vector<GameFault> Run(const LuaNode& tree) {
    for (const bool learning : {true, false}) {
      learning_ = learning;
      scopes_.assign(1, {});
      Visit(tree);
    }
    return std::move(faults_);
  }

 private:
  // --- Scopes

  Variable* Find(std::string_view name) {
    for (auto scope = scopes_.rbegin(); scope != scopes_.rend(); ++scope) {
      if (const auto found = scope->find(name); found != scope->end()) return &found->second;
    }
    return nullptr;
  }
  void Declare(std::string_view name, bool body = false) { scopes_.back()[std::string(name)] = {depth_, body}; }
  bool IsGlobal(const LuaNode& node, std::string_view name) {
    return node.kind == LuaNodeKind::kName && node.text == name && Find(name) == nullptr;
  }
  bool HoldsBody(const LuaNode& node) {
    if (node.kind != LuaNodeKind::kName) return false;
    const Variable* variable = Find(node.text);
    return variable != nullptr && variable->body;
  }
  // Code that runs in callbacks, where nothing that outlives them may be written.
  bool InCallbacks() const { return depth_ > 0 && loading_ == 0; }

  // --- Faults

  void Fault(const LuaNode& node, std::string text) {
    if (!learning_) faults_.push_back({node.line, std::move(text)});
  }
  void Fault(const LuaNode& node, std::string text, const Suggestion& suggestion) {
    if (!suggestion.best().empty()) absl::StrAppend(&text, "; did you mean ", Quote(suggestion.best()), "?");
    Fault(node, std::move(text));
  }

  // --- Walking

  void Visit(const LuaNode& node) {
    switch (node.kind) {
      case LuaNodeKind::kName:
        return VisitName(node);
      case LuaNodeKind::kIndex:
        return VisitIndex(node);
      case LuaNodeKind::kCall:
        return VisitCall(node);
      case LuaNodeKind::kMethod:
        return VisitMethod(node);
      case LuaNodeKind::kFunction:
        return VisitFunction(node, nullptr);
      case LuaNodeKind::kField:
        return VisitField(node);
      case LuaNodeKind::kBlock:
        return InScope([&] { VisitAll(node); });
      case LuaNodeKind::kLocal:
        return VisitLocal(node);
      case LuaNodeKind::kLocalFunction:
        Declare(node.names.front());
        return VisitNamedFunction(*node.children.front(), node.names.front());
      case LuaNodeKind::kAssign:
        return VisitAssign(node);
      case LuaNodeKind::kFor:
        return VisitFor(node);
      case LuaNodeKind::kRepeat:  // the condition sees the locals of the block
        return InScope([&] {
          VisitAll(*node.children[0]);
          Visit(*node.children[1]);
        });
      default:
        return VisitAll(node);
    }
  }

  void VisitAll(const LuaNode& node) {
    for (const auto& child : node.children) Visit(*child);
  }

  template <class Action>
  void InScope(const Action& action) {
    scopes_.emplace_back();
    action();
    scopes_.pop_back();
  }

  void VisitName(const LuaNode& node) {
    if (Find(node.text) != nullptr || known_.globals.contains(node.text) || defined_.contains(node.text)) return;
    if (node.text == "_ENV" || node.text == "_G") return;
    Suggestion suggestion(node.text);
    for (const std::string& name : known_.globals) suggestion.Offer(name);
    for (const std::string& name : defined_) suggestion.Offer(name);
    Fault(node, absl::StrCat(Quote(node.text), " is not defined"), suggestion);
  }

  void VisitField(const LuaNode& node) {
    if (node.children.size() == 2 && node.children[0]->kind == LuaNodeKind::kText) {
      fields_.insert(std::string(node.children[0]->text));
    }
    VisitAll(node);
  }

  void VisitLocal(const LuaNode& node) {
    for (std::size_t i = 0; i < node.children.size(); ++i) {
      if (node.children[i]->kind == LuaNodeKind::kFunction && i < node.names.size()) {
        VisitNamedFunction(*node.children[i], node.names[i]);
      } else {
        Visit(*node.children[i]);
      }
    }
    for (std::size_t i = 0; i < node.names.size(); ++i) {
      Declare(node.names[i], i < node.children.size() && HoldsBody(*node.children[i]));
    }
  }

  void VisitFor(const LuaNode& node) {
    for (std::size_t i = 0; i + 1 < node.children.size(); ++i) Visit(*node.children[i]);
    InScope([&] {
      for (const std::string_view name : node.names) Declare(name);
      Visit(*node.children.back());
    });
  }

  // `callback` is nullptr for functions that are none of a kind's.
  void VisitFunction(const LuaNode& node, const Callback* callback) {
    ++depth_;
    InScope([&] {
      for (std::size_t i = 0; i < node.names.size(); ++i) Declare(node.names[i], IsBodyParameter(callback, i));
      VisitAll(node);
    });
    --depth_;
  }

  static bool IsBodyParameter(const Callback* callback, std::size_t place) {
    if (callback == nullptr || callback->receiver != Receiver::kBody) return false;
    if (place == 0) return true;
    return place <= callback->parameters.size() && callback->parameters[place - 1].types == kBodyType;
  }

  // A function that is called while the file loads is taken for a part of that.
  void VisitNamedFunction(const LuaNode& node, std::string_view name) {
    const bool called = called_while_loading_.contains(name);
    loading_ += called ? 1 : 0;
    VisitFunction(node, nullptr);
    loading_ -= called ? 1 : 0;
  }

  // --- Calls

  void VisitCall(const LuaNode& node) {
    const LuaNode& called = *node.children.front();
    if (depth_ == 0 && called.kind == LuaNodeKind::kName) called_while_loading_.insert(std::string(called.text));
    if (called.kind == LuaNodeKind::kIndex && HoldsBody(*called.children[0]) &&
        called.children[1]->kind == LuaNodeKind::kText &&
        FindFunction(Receiver::kBody, called.children[1]->text) != nullptr && !TakesItself(node)) {
      Fault(node, absl::StrCat("call it as ", std::string(called.children[0]->text), ":",
                               std::string(called.children[1]->text), "(...), with a colon"));
    }
    if (called.kind == LuaNodeKind::kIndex && IsGlobal(*called.children[0], "world")) CheckWorldCall(node);
    VisitCalled(node);
  }

  // A prefab that the scene does not have, and what the world would tell a callback that is not there.
  void CheckWorldCall(const LuaNode& node) {
    const LuaNode& name = *node.children.front()->children[1];
    const bool text = node.children.size() > 1 && node.children[1]->kind == LuaNodeKind::kText;
    if (name.text == "spawn" && text) return CheckPrefab(*node.children[1]);
    const std::string callback = name.text == "send" ? "on_message" : name.text == "after" ? "on_timer" : "";
    if (callback.empty() || defined_.contains(callback) || defined_.contains("_G." + callback)) return;
    Fault(name, absl::StrCat("`world.", std::string(name.text), "` does nothing: the file has no function ",
                             Quote(callback)));
  }

  void CheckPrefab(const LuaNode& name) {
    Suggestion suggestion(name.text);
    for (const Prefab& prefab : scene_.prefabs) {
      if (prefab.name == name.text) return;
      suggestion.Offer(prefab.name);
    }
    Fault(name, absl::StrCat("the scene has no prefab ", Quote(name.text)), suggestion);
  }

  // `self.impulse(self, v)`
  static bool TakesItself(const LuaNode& call) {
    return call.children.size() > 1 && call.children[1]->kind == LuaNodeKind::kName &&
           call.children[1]->text == call.children[0]->children[0]->text;
  }

  // Functions among the arguments of a call that is made while the file loads may be called by it.
  void VisitCalled(const LuaNode& node) {
    const int loading = depth_ == 0 ? 1 : 0;
    loading_ += loading;
    VisitAll(node);
    loading_ -= loading;
  }

  void VisitMethod(const LuaNode& node) {
    if (HoldsBody(*node.children.front())) {
      CheckBodyFunction(node);
    } else if (!learning_) {
      CheckLikelyFunction(node);
    }
    VisitCalled(node);
  }

  void CheckBodyFunction(const LuaNode& node) {
    const Function* function = FindFunction(Receiver::kBody, node.text);
    if (function == nullptr) {
      Suggestion suggestion(node.text);
      for (const Function& known : Functions()) {
        if (known.receiver == Receiver::kBody) suggestion.Offer(known.name);
      }
      return Fault(node, absl::StrCat("bodies have no function ", Quote(node.text)), suggestion);
    }
    const bool property = function->number == kBodyGet || function->number == kBodySet;
    if (property && node.children.size() > 1 && node.children[1]->kind == LuaNodeKind::kText) {
      CheckProperty(*node.children[1], node.children[1]->text, false);
    }
  }

  // The receiver is unknown, so only a name that nobody has and that is nearly one of a body's functions is a fault.
  void CheckLikelyFunction(const LuaNode& node) {
    for (const auto& [name, library] : known_.libraries) {
      if (library.contains(node.text)) return;
    }
    constexpr std::string_view kOfVectors[] = {"length", "dot", "cross", "normalized", "apply"};
    if (fields_.contains(node.text) || std::ranges::find(kOfVectors, node.text) != std::end(kOfVectors)) return;
    Suggestion suggestion(node.text);
    for (const Function& function : Functions()) {
      if (function.name == node.text) return;
      if (function.receiver != Receiver::kWorld) suggestion.Offer(function.name);
    }
    if (!suggestion.best().empty()) {
      Fault(node, absl::StrCat("nothing has a function ", Quote(node.text)), suggestion);
    }
  }

  // --- Fields

  // `field`: it is written like a function of the body, so that one may be meant.
  void CheckProperty(const LuaNode& node, std::string_view name, bool field) {
    Suggestion suggestion(name);
    for (const PropertyDef& property : scene_.properties) {
      if (property.name == name) return;
      suggestion.Offer(property.name);
    }
    for (const Function& function : Functions()) {
      if (field && function.receiver == Receiver::kBody) suggestion.Offer(function.name);
    }
    Fault(node, absl::StrCat("the scene declares no property ", Quote(name)), suggestion);
  }

  void CheckKind(const LuaNode& node, std::string_view name) {
    Suggestion suggestion(name);
    for (const std::string& kind : scene_.kinds) {
      if (kind == name && !kind.empty()) return;
      suggestion.Offer(kind);
    }
    Fault(node, absl::StrCat("the scene has no bodies of the kind ", Quote(name)), suggestion);
  }

  void VisitIndex(const LuaNode& node) {
    const LuaNode &object = *node.children[0], &key = *node.children[1];
    if (key.kind == LuaNodeKind::kText) {
      if (HoldsBody(object) && FindFunction(Receiver::kBody, key.text) == nullptr) CheckProperty(key, key.text, true);
      if (IsGlobal(object, "kinds")) CheckKind(key, key.text);
      CheckLibrary(object, key);
    }
    VisitAll(node);
  }

  void CheckLibrary(const LuaNode& object, const LuaNode& key) {
    if (object.kind != LuaNodeKind::kName || Find(object.text) != nullptr) return;
    const auto library = known_.libraries.find(object.text);
    if (library == known_.libraries.end() || library->second.contains(key.text)) return;
    const std::string path = absl::StrCat(std::string(object.text), ".", std::string(key.text));
    if (defined_.contains(path) || defined_.contains(object.text)) return;
    Suggestion suggestion(key.text);
    if (object.text == "world") {
      for (const PropertyDef& property : scene_.instance_properties) {
        if (property.name == key.text) return;
        suggestion.Offer(property.name);
      }
    }
    for (const std::string& name : library->second) suggestion.Offer(name);
    std::string text = absl::StrCat("there is no ", Quote(path));
    if (!suggestion.best().empty()) {
      absl::StrAppend(&text, "; did you mean `", library->first, ".", std::string(suggestion.best()), "`?");
    }
    Fault(key, std::move(text));
  }

  // --- Assignments

  void VisitAssign(const LuaNode& node) {
    for (std::size_t i = 0; i < node.targets; ++i) {
      const std::size_t at = node.targets + i;
      VisitTarget(*node.children[i], at < node.children.size() ? node.children[at].get() : nullptr);
    }
    for (std::size_t i = 2 * node.targets; i < node.children.size(); ++i) Visit(*node.children[i]);
  }

  // `value` is nullptr where it comes out of a call.
  void VisitTarget(const LuaNode& target, const LuaNode* value) {
    if (target.kind == LuaNodeKind::kName) {
      VisitNameTarget(target, value);
    } else {
      VisitFieldTarget(target, value);
    }
  }

  void VisitNameTarget(const LuaNode& target, const LuaNode* value) {
    if (Variable* variable = Find(target.text); variable != nullptr) {
      if (variable->depth == 0 && InCallbacks()) {
        Fault(target, absl::StrCat(Quote(target.text),
                                   " would be kept between callbacks and lost with a handover; keep it in a property"));
      }
      variable->body = value != nullptr && HoldsBody(*value);
    } else if (InCallbacks()) {
      Fault(target, absl::StrCat(Quote(target.text), " is written outside of loading; keep state in properties"));
    } else {
      if (depth_ == 0 && target.text.starts_with("on_")) CheckWorldCallback(target);
    }
    const bool global = Find(target.text) == nullptr;
    if (global) defined_.insert(std::string(target.text));
    if (value == nullptr) return;
    if (global && target.text == "kinds" && value->kind == LuaNodeKind::kTable) return VisitKinds(*value);
    if (value->kind == LuaNodeKind::kFunction) return VisitNamedFunction(*value, target.text);
    Visit(*value);
  }

  void CheckWorldCallback(const LuaNode& target) {
    Suggestion suggestion(target.text);
    for (const Callback& callback : Callbacks()) {
      if (callback.receiver == Receiver::kBody) continue;
      if (callback.name == target.text) return;
      suggestion.Offer(callback.name);
    }
    const bool of_bodies = FindCallback(Receiver::kBody, target.text) != nullptr;
    Fault(target,
          absl::StrCat(Quote(target.text), " is no callback of the world",
                       of_bodies ? absl::StrCat("; write kinds.KIND.", std::string(target.text)) : std::string()),
          suggestion);
  }

  // The name at the root of a chain of fields, and the chain as it is written; nullptr where it is a call.
  static const LuaNode* RootOf(const LuaNode& target, std::string& path) {
    const LuaNode* node = &target;
    std::string rest;
    while (node->kind == LuaNodeKind::kIndex) {
      const LuaNode& key = *node->children[1];
      rest = absl::StrCat(key.kind == LuaNodeKind::kText ? absl::StrCat(".", std::string(key.text)) : "[...]", rest);
      node = node->children[0].get();
    }
    if (node->kind != LuaNodeKind::kName) return nullptr;
    path = absl::StrCat(std::string(node->text), rest);
    return node;
  }

  // `world.score`, where the scene declares it.
  bool IsWorldProperty(const LuaNode& node) {
    if (node.kind != LuaNodeKind::kIndex || node.children[1]->kind != LuaNodeKind::kText) return false;
    const LuaNode& object = *node.children[0];
    if (object.kind != LuaNodeKind::kName || object.text != "world" || Find(object.text) != nullptr) return false;
    return std::ranges::find(scene_.instance_properties, node.children[1]->text, &PropertyDef::name) !=
           scene_.instance_properties.end();
  }

  void VisitFieldTarget(const LuaNode& target, const LuaNode* value) {
    std::string path;
    const LuaNode* root = RootOf(target, path);
    const Variable* variable = root == nullptr ? nullptr : Find(root->text);
    if (target.kind == LuaNodeKind::kIndex && target.children[1]->kind == LuaNodeKind::kText) {
      fields_.insert(std::string(target.children[1]->text));
    }
    if (InCallbacks() && root != nullptr && IsWorldProperty(target)) {
      Visit(target);
      if (value != nullptr) Visit(*value);
      return;
    }
    if (root != nullptr && variable == nullptr) defined_.insert(path);
    if (root != nullptr && InCallbacks() && (variable == nullptr || variable->depth == 0)) {
      Fault(target, absl::StrCat(Quote(path), " is written outside of loading; keep state in properties"));
    }
    Visit(target);
    if (value == nullptr) return;
    if (target.kind == LuaNodeKind::kIndex && VisitKindTarget(target, *value)) return;
    if (value->kind == LuaNodeKind::kFunction) return VisitFunction(*value, nullptr);
    Visit(*value);
  }

  // --- Kinds

  // `kinds.crate = {...}` and `kinds.crate.on_contact = f`; false for anything else.
  bool VisitKindTarget(const LuaNode& target, const LuaNode& value) {
    const LuaNode &object = *target.children[0], &key = *target.children[1];
    if (key.kind != LuaNodeKind::kText) return false;
    if (IsGlobal(object, "kinds") && value.kind == LuaNodeKind::kTable) {
      VisitKind(key.text, value);
      return true;
    }
    if (object.kind != LuaNodeKind::kIndex || !IsGlobal(*object.children[0], "kinds")) return false;
    VisitCallback(object.children[1]->kind == LuaNodeKind::kText ? object.children[1]->text : "...", key, value);
    return true;
  }

  void VisitKinds(const LuaNode& table) {
    for (const auto& field : table.children) {
      const bool named = field->children.size() == 2 && field->children[0]->kind == LuaNodeKind::kText;
      if (named) CheckKind(*field->children[0], field->children[0]->text);
      if (named && field->children[1]->kind == LuaNodeKind::kTable) {
        VisitKind(field->children[0]->text, *field->children[1]);
      } else {
        VisitAll(*field);
      }
    }
  }

  void VisitKind(std::string_view kind, const LuaNode& table) {
    for (const auto& field : table.children) {
      if (field->children.size() == 2 && field->children[0]->kind == LuaNodeKind::kText) {
        VisitCallback(kind, *field->children[0], *field->children[1]);
      } else {
        VisitAll(*field);
      }
    }
  }

  void VisitCallback(std::string_view kind, const LuaNode& key, const LuaNode& value) {
    const Callback* callback = FindCallback(Receiver::kBody, key.text);
    if (callback == nullptr) {
      Suggestion suggestion(key.text);
      for (const Callback& known : Callbacks()) {
        if (known.receiver == Receiver::kBody) suggestion.Offer(known.name);
      }
      Fault(key, absl::StrCat("`kinds.", std::string(kind), ".", std::string(key.text), "` is no callback of bodies"),
            suggestion);
    }
    if (value.kind == LuaNodeKind::kFunction) return VisitFunction(value, callback);
    Visit(value);
  }

  const Scene& scene_;
  const KnownNames known_;
  bool learning_ = true;
  NameSet defined_;               // globals of the file, and fields of globals by their paths
  NameSet fields_;                // names of fields and methods of the file's tables
  NameSet called_while_loading_;  // functions
  std::vector<std::map<std::string, Variable, std::less<>>> scopes_;
  int depth_ = 0;    // functions around the present node
  int loading_ = 0;  // how many of them run while the file loads
  std::vector<GameFault> faults_;
};

}  // namespace

std::vector<GameFault> CheckSource(const LuaNode& tree, const Scene& scene) { return SourceWalk(scene).Run(tree); }

}  // namespace tessera::game
