// Drifter: the smallest game there is, in C#. Joins an instance, pushes its body about in slow circles, and prints what
// it sees twice a second.
//
//   mono drifter.exe GRANT_FILE [SECONDS]        the grant is what a game's backend gives
using System;
using System.IO;
using System.Threading;
using Tessera;

static class Drifter {
  const long Second = 1000000000;

  static void Draw(World world) {
    ReadOnlySpan<Body> bodies = world.Bodies();
    Console.Write("tick {0}: {1} bodies", world.Tick, bodies.Length);
    foreach (Body body in bodies) {
      if (body.Own) Console.Write("; I am at {0} in region {1}", body.Position, body.Region);
    }
    Console.WriteLine();
  }

  static void Play(World world, long seconds) {
    long start = World.Now, draw_at = start;
    bool inside = false;
    while (World.Now < start + seconds * Second && !world.Ended) {
      world.Poll();
      foreach (Event one in world.TakeEvents()) {
        if (one.Detail != "") Console.WriteLine("{0}: {1}", one.Kind, one.Detail);
      }
      foreach (GameEvent one in world.TakeGameEvents()) Console.WriteLine("the game says {0}", one.Name);
      if (!inside && world.State != State.Joining) {
        inside = true;
        Console.WriteLine("player {0} in {1}", world.Player, world.SceneName);
      }
      double angle = (World.Now - start) / (double)Second;
      world.Move(new Vector3d(500 * Math.Cos(angle), 0, 500 * Math.Sin(angle)));
      if (World.Now >= draw_at) {
        draw_at += Second / 2;
        Draw(world);
      }
      Thread.Sleep(8);  // a game draws its frame meanwhile
    }
    if (!world.Ended) world.Leave();
  }

  static int Main(string[] arguments) {
    if (arguments.Length < 1) {
      Console.Error.WriteLine("usage: drifter.exe GRANT_FILE [SECONDS]");
      return 2;
    }
    try {
      using (World world = World.Join(File.ReadAllBytes(arguments[0]))) {
        Play(world, arguments.Length > 1 ? long.Parse(arguments[1]) : 10);
      }
    } catch (TesseraException error) {
      Console.Error.WriteLine(error.Message);
      return 1;
    }
    return 0;
  }
}
