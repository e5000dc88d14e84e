// The C# layer against a world in this process, in virtual time, and by a grant against an instance.
//
//   world_test.exe            every test; the exit code is the number of those that failed
//   world_test.exe grant ADDRESS INSTANCE FILE
using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Reflection;
using System.Runtime.InteropServices;
using System.Text;
using Tessera;
using Tessera.Native;

static class WorldTest {
  const int Balls = 100;  // more than a world first has room for
  const long Frame = 1000000000 / 60;

  const string Game = @"
function on_command(player, bytes)
  if bytes == 'end' then return player:kick('enough') end
  print('command of ' .. #bytes)
  world.score = world.score + 1
  player:body().health = 55
  player:send('echo', { text = bytes, whole = 3, real = 0.5, yes = true, at = vec(1, 2, 3), mine = player:body() })
end";

  static string Scene() {
    var balls = new StringBuilder();
    for (int i = 0; i < Balls; ++i) {
      balls.AppendFormat(", {{\"id\": {0}, \"mass\": 1, \"shape\": {{\"sphere\": {{\"radius\": 0.4}}}}," +
                         "\"pose\": {{\"position\": {{\"x\": {1}, \"y\": 5, \"z\": {2}}}}}}}",
                         10 + i, i % 10 - 15, i / 10 - 15);
    }
    return @"{""name"": ""box"", ""tick_rate_hz"": 60,
      ""bounds"": {""min"": {""x"": -20, ""y"": -5, ""z"": -20}, ""max"": {""x"": 20, ""y"": 20, ""z"": 20}},
      ""properties"": [{""name"": ""health"", ""number"": 100}, {""name"": ""team"", ""text"": ""red""}],
      ""instance_properties"": [{""name"": ""score"", ""number"": 0}],
      ""bodies"": [{""id"": 1, ""motion"": ""MOTION_STATIC"", ""shape"": {""plane"": {""normal"": {""y"": 1}}}}" +
        balls + @"],
      ""player"": {""body"": {""mass"": 80, ""shape"": {""sphere"": {""radius"": 0.5}}}, ""spawn_points"": [{""y"": 0.5}],
                 ""max_force"": 800, ""max_speed"": 5}}";
  }

  static void Expect(bool holds, string what) {
    if (!holds) throw new Exception("not so: " + what);
  }

  static TesseraException Refused(Action action) {
    try {
      action();
    } catch (TesseraException error) {
      return error;
    }
    throw new Exception("nothing was refused");
  }

  // A world in this process with one player.
  sealed class Played : IDisposable {
    public readonly LocalWorld Local = new LocalWorld(Scene(), Game);
    public readonly World World;
    public readonly List<Event> Events = new List<Event>();
    public readonly List<GameEvent> GameEvents = new List<GameEvent>();
    public long Time = 3600L * 1000000000;

    public Played(JoinOptions options = null) { World = Local.Join(options); }

    public void Step() {
      Time += Frame;
      Local.Advance(Time);
      World.Poll(Time);
      Events.AddRange(World.TakeEvents());
      GameEvents.AddRange(World.TakeGameEvents());
    }

    // Frames until it holds; a failure takes ten seconds of real time.
    public void Until(Func<bool> holds, string what) {
      long limit = World.Now + 10L * 1000000000;
      while (!holds()) {
        Expect(World.Now < limit, what);
        Step();
      }
    }

    public void UntilPlaying() {
      Until(() => World.State == State.Playing && World.Find(World.OwnBody, out Body own), "the world moves");
    }

    public double HeightOf(ulong id) {
      foreach (Body body in World.Bodies(Time)) {
        if (body.Id == id) return body.Position.Y;
      }
      return double.NaN;
    }

    public void Dispose() {
      World.Dispose();
      Local.Dispose();
    }
  }

  public static void EveryFunctionIsInItsLibrary() {
    MethodInfo[] functions = typeof(Api).GetMethods(BindingFlags.Public | BindingFlags.Static);
    Expect(functions.Length > 50, "there are functions");
    foreach (MethodInfo function in functions) Marshal.Prelink(function);  // throws EntryPointNotFoundException
    Expect(World.LibraryVersion == Api.TESSERA_VERSION_MAJOR * 1000 + Api.TESSERA_VERSION_MINOR, "version");
  }

  public static void AnErrorIsAnExceptionWithTheLibrarysLine() {
    TesseraException grant = Refused(() => World.Join(new byte[] { 1, 2, 3 }));
    Expect(grant.Code == Code.InvalidArgument && grant.Message.Contains("grant"), grant.Message);
    TesseraException scene = Refused(() => new LocalWorld("{\"bodies\": 3}"));
    Expect(scene.Code == Code.InvalidArgument && scene.Message.Contains("bodies"), scene.Message);
    TesseraException file = Refused(() => World.Play("/nowhere/ünd.tsr"));
    Expect(file.Code == Code.NotFound && file.Message.Contains("/nowhere/ünd.tsr"), file.Message);
  }

  public static void AllBodiesComeInOneSpanAndMove() {
    using (var played = new Played()) {
      played.UntilPlaying();
      played.Until(() => played.World.Bodies(played.Time).Length == Balls + 1, "all bodies are there");
      Expect(played.Events.Count(one => one.Kind == EventKind.Appeared) == Balls + 1, "each has appeared");
      played.Until(() => played.HeightOf(10) < 1, "a ball falls");
      Expect(played.World.SceneName == "box" && played.World.Player == 1, "who plays, and where");
      Expect(played.World.Find(played.World.OwnBody, out Body own) && own.Orientation.W > 0.5, "the own body stands");
    }
  }

  public static void AForceMovesTheOwnBody() {
    using (var played = new Played()) {
      played.UntilPlaying();
      Body own = default(Body);
      played.Until(() => {
        played.World.Move(new Vector3d(800, 0, 0));
        return played.World.Find(played.World.OwnBody, out own) && own.Position.X > 2;
      }, "it goes");
      Expect(own.LinearVelocity.X > 0.5 && Math.Abs(own.Position.Z) < 1, "along x");
      Expect(played.World.Stats().bytes_in > 0, "statistics");
    }
  }

  public static void TheGameGetsCommandsAndAnswers() {
    using (var played = new Played()) {
      played.UntilPlaying();
      played.World.Send("grüß");
      played.World.Send(new byte[0]);
      played.Until(() => played.GameEvents.Count == 2, "two answers");
      IReadOnlyDictionary<string, object> echo = played.GameEvents[0].Values;
      Expect(played.GameEvents[0].Name == "echo" && (string)echo["text"] == "grüß", "the text");
      Expect((string)played.GameEvents[1].Values["text"] == "", "the empty one");
      Expect((long)echo["whole"] == 3 && (double)echo["real"] == 0.5 && (bool)echo["yes"], "numbers");
      Expect(((Vector3d)echo["at"]).Z == 3 && ((BodyId)echo["mine"]).Value == played.World.OwnBody, "references");
      Expect(played.Local.TakeLines().SequenceEqual(new[] { "command of 6", "command of 0" }), "what it prints");
      TesseraException error = Refused(() => played.World.Send(new byte[Api.TESSERA_MAX_COMMAND + 1]));
      Expect(error.Code == Code.InvalidArgument, error.Message);
    }
  }

  public static void PropertiesAreReadByName() {
    using (var played = new Played()) {
      played.UntilPlaying();
      ulong own = played.World.OwnBody;
      Expect((string)played.World.PropertyOf(own, "team") == "red", "a text");
      Expect((long)played.World.PropertyOf(own, "health") == 100, "a number");
      Expect(played.World.PropertyOf(own, "nonsense") == null, "one that is not declared");
      played.World.Send("hit");
      played.Until(() => (long)played.World.PropertyOf(own, "health") == 55, "health changes");
      played.Until(() => (long)played.World.WorldProperty("score") == 1, "the score changes");
      Expect(played.Events.Any(one => one.Kind == EventKind.PropertyChanged && one.Property == "health"), "an event");
    }
  }

  public static void LeavingAsksWhoGaveTheGrant() {
    byte[] shown = null;
    uint waits = 0;
    var options = new JoinOptions { OnLeave = (token, deadline) => {
      shown = token;
      waits = deadline;
      return Code.Ok;
    } };
    using (var played = new Played(options)) {
      played.UntilPlaying();
      byte[] token = played.World.ReturnToken();
      GC.Collect();  // the callback outlives the call that gave it
      played.World.Leave(1234);
      Expect(token.Length > 0 && shown != null && shown.SequenceEqual(token) && waits == 1234, "the token");
      Expect(played.World.Ended, "it has ended");
    }
    options.OnLeave = (token, deadline) => { throw new Exception("the backend is gone"); };
    using (var played = new Played(options)) {
      played.UntilPlaying();
      Expect(Refused(() => played.World.Leave()).Code == Code.Internal, "an exception of the game is an error");
    }
  }

  public static void AKickedPlayerIsToldInTheGamesWords() {
    using (var played = new Played()) {
      played.UntilPlaying();
      played.World.Send("end");
      TesseraException error = Refused(() => played.Until(() => false, "it ends"));
      Expect(error.Code == Code.Aborted && played.World.DisconnectReason == "enough", error.Message);
    }
  }

  public static void ADisposedWorldIsRefused() {
    var played = new Played();
    played.Dispose();
    played.Dispose();
    foreach (Action call in new Action[] { () => played.World.Poll(), () => played.Local.Advance(0),
                                           () => played.World.Bodies() }) {
      bool refused = false;
      try {
        call();
      } catch (ObjectDisposedException) {
        refused = true;
      }
      Expect(refused, "a call after Dispose");
    }
  }

  static int Main(string[] arguments) {
    if (arguments.Length == 4 && arguments[0] == "grant") {
      File.WriteAllBytes(arguments[3], Control.GetGrant(arguments[1], arguments[2], "ada"));
      return 0;
    }
    int failed = 0;
    MethodInfo[] tests = typeof(WorldTest).GetMethods(BindingFlags.Public | BindingFlags.Static | BindingFlags.DeclaredOnly);
    foreach (MethodInfo test in tests) {
      try {
        test.Invoke(null, null);
        Console.WriteLine("ok {0}", test.Name);
      } catch (TargetInvocationException error) {
        ++failed;
        Console.WriteLine("FAILED {0}: {1}", test.Name, error.InnerException);
      }
    }
    Console.WriteLine("{0} passed, {1} failed", tests.Length - failed, failed);
    return failed;
  }
}
