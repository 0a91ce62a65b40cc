/* Wander about, in Java, without a library: KiKS's TCP port, or a serial server in front of the real robot.

   kiks serve --tcp 10020 &
   java Wander.java localhost 10020 60 */

import java.io.BufferedReader;
import java.io.IOException;
import java.io.InputStreamReader;
import java.io.OutputStream;
import java.net.Socket;
import java.nio.charset.StandardCharsets;

public class Wander {
    private final OutputStream out;
    private final BufferedReader in;

    Wander(Socket socket) throws IOException {
        out = socket.getOutputStream();
        in = new BufferedReader(new InputStreamReader(socket.getInputStream(), StandardCharsets.US_ASCII));
    }

    int[] ask(String command) throws IOException {
        out.write((command + "\n").getBytes(StandardCharsets.US_ASCII));
        out.flush();
        String[] words = in.readLine().trim().split(",");
        int[] numbers = new int[words.length - 1];
        for (int k = 0; k < numbers.length; k++) {
            numbers[k] = Integer.parseInt(words[k + 1]);
        }
        return numbers;
    }

    public static void main(String[] words) throws IOException {
        try (Socket socket = new Socket(words[0], Integer.parseInt(words[1]))) {
            socket.setTcpNoDelay(true);
            Wander robot = new Wander(socket);
            int turns = 0;
            for (int step = Integer.parseInt(words[2]); step > 0; step--) {
                int[] n = robot.ask("N");
                boolean isNear = Math.max(Math.max(n[1], n[2]), Math.max(n[3], n[4])) > 200;
                robot.ask(isNear ? "D,4,-4" : "D,6,6");
                turns += isNear ? 1 : 0;
            }
            robot.ask("D,0,0");
            System.out.println("turned " + turns + " times");
        }
    }
}
