<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="de" sourcelanguage="en">
  <context>
    <name>TreeDGS</name>
    <message>
      <source>Trees</source>
      <translation>Bäume</translation>
    </message>
    <message>
      <source>Change</source>
      <translation>Veränderung</translation>
    </message>
    <message>
      <source>Camera stations</source>
      <translation>Kamerastandorte</translation>
    </message>
    <message>
      <source>Pairs</source>
      <translation>Paare</translation>
    </message>
    <message>
      <source>PHOTOS: {folder} holds {found} photos, expected at least {least} (better 40 or more) as {kinds}.</source>
      <translation>PHOTOS: {folder} enthält {found} Fotos, erwartet sind mindestens {least} (besser 40 oder mehr) als {kinds}.</translation>
    </message>
    <message>
      <source>Flight plan</source>
      <translation>Flugplan</translation>
    </message>
    <message>
      <source>Plots; and what stands there, as a layer (with trees also the crown base) or in numbers</source>
      <translation>Probeflächen; und was dort steht, als Layer (mit Bäumen auch der Kronenansatz) oder in Zahlen</translation>
    </message>
    <message>
      <source>INPUT: {path} is not a LAS or LAZ file; convert the cloud to LAZ first.</source>
      <translation>INPUT: {path} ist keine LAS- oder LAZ-Datei; wandeln Sie die Wolke zuerst in LAZ um.</translation>
    </message>
    <message>
      <source>&lt;p&gt;&lt;b&gt;Remove the engine: its libraries, and the Python that was fetched for it.&lt;/b&gt;&lt;/p&gt;
&lt;p&gt;Do this before you uninstall the plugin, which QGIS removes without it. Engines of former versions go too. Your
results, workspaces and the logs of former jobs stay (these only if you do not tick them), and so does an engine that
the plugin in another QGIS profile uses. &lt;b&gt;Set up the engine&lt;/b&gt; brings it back.&lt;/p&gt;</source>
      <translation>&lt;p&gt;&lt;b&gt;Entfernt den Rechenkern: seine Bibliotheken und das Python, das für ihn geholt wurde.&lt;/b&gt;&lt;/p&gt;
&lt;p&gt;Tun Sie das, bevor Sie die Erweiterung deinstallieren; QGIS entfernt sie ohne ihn. Rechenkerne früherer Versionen
gehen auch. Ihre Ergebnisse, Arbeitsordner und die Protokolle früherer Aufträge bleiben (diese nur, wenn Sie sie nicht
ankreuzen), ebenso ein Rechenkern, den die Erweiterung in einem anderen QGIS-Profil benutzt. &lt;b&gt;Rechenkern einrichten&lt;/b&gt; bringt ihn zurück.&lt;/p&gt;</translation>
    </message>
    <message>
      <source>Remove the engine</source>
      <translation>Rechenkern entfernen</translation>
    </message>
    <message>
      <source>Setup</source>
      <translation>Einrichtung</translation>
    </message>
    <message>
      <source>Free the disk that the engine takes.</source>
      <translation>Gibt den Plattenplatz des Rechenkerns frei.</translation>
    </message>
    <message>
      <source>Removed from {folder}: {size} are free again.</source>
      <translation>Aus {folder} entfernt: {size} sind wieder frei.</translation>
    </message>
    <message>
      <source>Logs of former jobs too</source>
      <translation>Auch Protokolle früherer Aufträge</translation>
    </message>
    <message>
      <source>The logs of the last 20 jobs; results lie where you wrote them and always stay.</source>
      <translation>Die Protokolle der letzten 20 Aufträge; Ergebnisse liegen, wo Sie sie hingeschrieben haben, und bleiben immer.</translation>
    </message>
    <message>
      <source>{folder} stays: the plugin in {plugin} uses it; run this there too if it is not needed.</source>
      <translation>{folder} bleibt: Die Erweiterung in {plugin} benutzt ihn; starten Sie dies auch dort, falls er nicht gebraucht wird.</translation>
    </message>
    <message>
      <source>Disk that became free, GB</source>
      <translation>Frei gewordener Plattenplatz, GB</translation>
    </message>
    <message>
      <source>{folder} is in use and was not removed; let its jobs end, or stop them, and run this again.</source>
      <translation>{folder} wird benutzt und wurde nicht entfernt; lassen Sie seine Aufträge enden oder halten Sie sie an, und starten Sie dies erneut.</translation>
    </message>
    <message>
      <source>TREES: the layer '{layer}' is filtered or no file; remove the filter, or give its file.</source>
      <translation>TREES: Der Layer '{layer}' ist gefiltert oder keine Datei; den Filter entfernen oder seine Datei angeben.</translation>
    </message>
    <message>
      <source>Review trees</source>
      <translation>Bäume prüfen</translation>
    </message>
    <message>
      <source>3 Check</source>
      <translation>3 Prüfen</translation>
    </message>
    <message>
      <source>Open the panel in which a person decides about trees on the map.</source>
      <translation>Das Fenster öffnen, in dem ein Mensch auf der Karte über Bäume entscheidet.</translation>
    </message>
    <message>
      <source>&lt;p&gt;&lt;b&gt;Copy the sample flight: photos of a small simulated plot, with geotags, terrain and field table.&lt;/b&gt;&lt;/p&gt;
&lt;p&gt;Then run &lt;b&gt;Measure DBH from drone photos&lt;/b&gt; on it; &lt;i&gt;Plugins ▸ TreeDGS ▸ Try it with a sample flight&lt;/i&gt; opens
that with everything filled in. The photos are rendered, not taken: their trees are easier than yours.&lt;/p&gt;</source>
      <translation>&lt;p&gt;&lt;b&gt;Den Beispielflug kopieren: Fotos einer kleinen simulierten Fläche, mit Geotags, Gelände und Feldtabelle.&lt;/b&gt;&lt;/p&gt;
&lt;p&gt;Danach &lt;b&gt;BHD aus Drohnenfotos messen&lt;/b&gt; darauf anwenden; &lt;i&gt;Erweiterungen ▸ TreeDGS ▸ Mit einem Beispielflug ausprobieren&lt;/i&gt; öffnet das mit allem ausgefüllt. Die Fotos sind gerechnet, nicht aufgenommen: ihre Bäume sind leichter als Ihre.&lt;/p&gt;</translation>
    </message>
    <message>
      <source>Get the sample flight</source>
      <translation>Beispielflug holen</translation>
    </message>
    <message>
      <source>Get a small flight to try the plugin with.</source>
      <translation>Holt einen kleinen Flug zum Ausprobieren der Erweiterung.</translation>
    </message>
    <message>
      <source>Copy into</source>
      <translation>Kopieren nach</translation>
    </message>
    <message>
      <source>Left empty: into the plugin's data folder.</source>
      <translation>Leer: in den Datenordner der Erweiterung.</translation>
    </message>
    <message>
      <source>The flight's folder</source>
      <translation>Ordner des Flugs</translation>
    </message>
    <message>
      <source>Its coordinate reference system</source>
      <translation>Sein Koordinatenreferenzsystem</translation>
    </message>
    <message>
      <source>The sample flight is there: {folder}</source>
      <translation>Der Beispielflug ist da: {folder}</translation>
    </message>
    <message>
      <source>&lt;p&gt;&lt;b&gt;Install the libraries that the TreeDGS algorithms need, in an environment of their own.&lt;/b&gt;&lt;/p&gt;
&lt;p&gt;Makes a Python environment in your data folder (or in TREEDGS_HOME; {takes} at 50 Mbit/s), and installs the locked
list of libraries with pip. QGIS and its Python are not touched. Python 3.10 to 3.14 with venv is found on this
computer, or fetched for the engine alone. It needs the network or a folder of wheels. In the end the parts of TreeDGS
that compute most are compiled for this processor, so that the first job does not wait for it. What was cut short is
taken up by running it again. Engines of former versions are removed in the end; jobs and results stay. &lt;b&gt;Remove the
engine&lt;/b&gt; frees the disk.&lt;/p&gt;
&lt;p&gt;Parts that not everybody needs are ticked; run it again to add one. What is there stays, unless you start from
scratch.&lt;/p&gt;
&lt;p&gt;On a machine with &lt;code&gt;make&lt;/code&gt;, &lt;code&gt;make setup&lt;/code&gt; does the same for the repository.&lt;/p&gt;</source>
      <translation>&lt;p&gt;&lt;b&gt;Installiert die Bibliotheken, die die TreeDGS-Algorithmen brauchen, in einer eigenen Umgebung.&lt;/b&gt;&lt;/p&gt;
&lt;p&gt;Legt eine Python-Umgebung in Ihrem Datenordner an (oder in TREEDGS_HOME; {takes} bei 50 Mbit/s) und installiert mit pip die
festgelegte Liste von Bibliotheken. QGIS und sein Python bleiben unberührt. Ein Python 3.10 bis 3.14 mit venv wird auf diesem
Computer gefunden oder nur für den Rechenkern geholt. Es braucht das Netz oder einen Ordner mit Wheels. Am Ende werden die
Teile von TreeDGS, die am meisten rechnen, für diesen Prozessor übersetzt, damit der erste Auftrag nicht darauf wartet.
Was abgebrochen wurde,
geht beim nächsten Start weiter. Rechenkerne früherer Versionen werden am Ende entfernt; Aufträge und Ergebnisse bleiben.
&lt;b&gt;Rechenkern entfernen&lt;/b&gt; gibt den Platz frei.&lt;/p&gt;
&lt;p&gt;Teile, die nicht jeder braucht, werden angekreuzt; starten Sie es erneut, um einen hinzuzufügen. Was da ist, bleibt, außer Sie
beginnen von vorn.&lt;/p&gt;
&lt;p&gt;Auf einem Rechner mit &lt;code&gt;make&lt;/code&gt; tut &lt;code&gt;make setup&lt;/code&gt; dasselbe für das Repository.&lt;/p&gt;</translation>
    </message>
    <message>
      <source>Set up the engine</source>
      <translation>Rechenkern einrichten</translation>
    </message>
    <message>
      <source>Install the engine's libraries in an environment of their own.</source>
      <translation>Installiert die Bibliotheken des Rechenkerns in einer eigenen Umgebung.</translation>
    </message>
    <message>
      <source>Compiling for this processor, once, so that the first job is quick</source>
      <translation>Übersetzen für diesen Prozessor, einmal, damit der erste Auftrag schnell ist</translation>
    </message>
    <message>
      <source>{count} functions compiled in {time}.</source>
      <translation>{count} Funktionen in {time} übersetzt.</translation>
    </message>
    <message>
      <source>Python to build with</source>
      <translation>Python für die Einrichtung</translation>
    </message>
    <message>
      <source>A Python 3.10 to 3.14 with venv; left empty, the system's is found.</source>
      <translation>Ein Python 3.10 bis 3.14 mit venv; leer gelassen, wird das des Systems gefunden.</translation>
    </message>
    <message>
      <source>Folder of wheels (no network)</source>
      <translation>Ordner mit Wheels (ohne Netz)</translation>
    </message>
    <message>
      <source>A folder of .whl files, made on another machine with: pip download --require-hashes -r requirements-locked.txt -d FOLDER.</source>
      <translation>Ein Ordner mit .whl-Dateien, auf einem anderen Rechner erzeugt mit: pip download --require-hashes -r requirements-locked.txt -d ORDNER.</translation>
    </message>
    <message>
      <source>For which processor</source>
      <translation>Für welchen Prozessor</translation>
    </message>
    <message>
      <source>auto: with NVIDIA's library where a card and driver are found that it can use; cpu: without; cuda: with it in any case. Only Gaussians that are fitted with the device cuda use the card.</source>
      <translation>auto: mit NVIDIAs Bibliothek, wo eine dafür brauchbare Karte samt Treiber gefunden wird; cpu: ohne; cuda: in jedem Fall damit. Nur Gauß-Elemente, die mit dem Gerät cuda angepasst werden, nutzen die Karte.</translation>
    </message>
    <message>
      <source>Start from scratch</source>
      <translation>Neu anfangen</translation>
    </message>
    <message>
      <source>Remove the environment first, to repair a broken one.</source>
      <translation>Die Umgebung zuerst entfernen, um eine defekte zu beheben.</translation>
    </message>
    <message>
      <source>Compile for this processor</source>
      <translation>Für diesen Prozessor übersetzen</translation>
    </message>
    <message>
      <source>The first job does not wait for it then; without it the first job compiles.</source>
      <translation>Der erste Auftrag wartet dann nicht darauf; ohne das übersetzt der erste Auftrag.</translation>
    </message>
    <message>
      <source>WHEELS: {folder} is not a folder; give the folder that holds the .whl files.</source>
      <translation>WHEELS: {folder} ist kein Ordner; geben Sie den Ordner mit den .whl-Dateien an.</translation>
    </message>
    <message>
      <source>WHEELS: {folder}: holds no .whl files, expected the wheels of the engine's libraries.</source>
      <translation>WHEELS: {folder}: enthält keine .whl-Dateien, erwartet sind die Wheels der Bibliotheken des Rechenkerns.</translation>
    </message>
    <message>
      <source>PYTHON: {path} does not exist; give a Python program or leave it empty.</source>
      <translation>PYTHON: {path} gibt es nicht; geben Sie ein Python-Programm an oder lassen Sie es leer.</translation>
    </message>
    <message>
      <source>Engines of former versions and downloads are removed: {size} free again.</source>
      <translation>Rechenkerne früherer Versionen und Heruntergeladenes sind entfernt: {size} wieder frei.</translation>
    </message>
    <message>
      <source>{folder}, the engine of a former version, is in use and stays until the next set-up.</source>
      <translation>{folder}, der Rechenkern einer früheren Version, wird benutzt und bleibt bis zum nächsten Einrichten.</translation>
    </message>
    <message>
      <source>Measuring trees from photos and clouds does not need it; it can be added later.</source>
      <translation>Zum Messen von Bäumen aus Fotos und Punktwolken nicht nötig; kann später hinzugefügt werden.</translation>
    </message>
    <message>
      <source>The engine's Python</source>
      <translation>Python des Rechenkerns</translation>
    </message>
    <message>
      <source>The engine will use the graphics card: {why}.</source>
      <translation>Der Rechenkern wird die Grafikkarte nutzen: {why}.</translation>
    </message>
    <message>
      <source>The engine will use the processor only: {why}.</source>
      <translation>Der Rechenkern wird nur den Prozessor nutzen: {why}.</translation>
    </message>
    <message>
      <source>The engine is set up, but it could not compile ahead; the first job will: {why}</source>
      <translation>Der Rechenkern ist eingerichtet, konnte aber nicht vorab übersetzen; der erste Auftrag holt es nach: {why}</translation>
    </message>
    <message>
      <source>Stopped; run it again to go on where it ended.</source>
      <translation>Angehalten; starten Sie es erneut, um dort fortzufahren, wo es endete.</translation>
    </message>
    <message>
      <source>The QGIS setting treedgs/python still names {path} and comes first; clear it to use the environment that was just built.</source>
      <translation>Die QGIS-Einstellung treedgs/python nennt noch {path} und geht vor; löschen Sie sie, um die eben gebaute Umgebung zu verwenden.</translation>
    </message>
    <message>
      <source>the locked list of libraries</source>
      <translation>die festgeschriebene Liste der Bibliotheken</translation>
    </message>
    <message>
      <source>Trees and plots, or pairs</source>
      <translation>Bäume und Probeflächen, oder Paare</translation>
    </message>
    <message>
      <source>Tape check</source>
      <translation>Bandmaß-Prüfung</translation>
    </message>
    <message>
      <source>Trees to tape</source>
      <translation>Bäume zum Nachmessen</translation>
    </message>
    <message>
      <source>Terrain model</source>
      <translation>Geländemodell</translation>
    </message>
    <message>
      <source>Tree</source>
      <translation>Baum</translation>
    </message>
    <message>
      <source>growth</source>
      <translation>Zuwachs</translation>
    </message>
    <message>
      <source>yaw</source>
      <translation>Kurs</translation>
    </message>
    <message>
      <source>pitch</source>
      <translation>Kippung</translation>
    </message>
    <message>
      <source>Field tree</source>
      <translation>Feldbaum</translation>
    </message>
    <message>
      <source>measured tree</source>
      <translation>gemessener Baum</translation>
    </message>
    <message>
      <source>field</source>
      <translation>Feld</translation>
    </message>
    <message>
      <source>measured</source>
      <translation>gemessen</translation>
    </message>
    <message>
      <source>distance</source>
      <translation>Abstand</translation>
    </message>
    <message>
      <source>Plot</source>
      <translation>Probefläche</translation>
    </message>
    <message>
      <source>field trees paired</source>
      <translation>gepaarte Feldbäume</translation>
    </message>
    <message>
      <source>moved east, north</source>
      <translation>verschoben nach Ost, Nord</translation>
    </message>
    <message>
      <source>turned</source>
      <translation>gedreht</translation>
    </message>
    <message>
      <source>rejected</source>
      <translation>abgelehnt</translation>
    </message>
    <message>
      <source>no DBH</source>
      <translation>kein BHD</translation>
    </message>
    <message>
      <source>Photo</source>
      <translation>Foto</translation>
    </message>
    <message>
      <source>over the take-off</source>
      <translation>über dem Startplatz</translation>
    </message>
    <message>
      <source>over the ground</source>
      <translation>über dem Boden</translation>
    </message>
    <message>
      <source>expected</source>
      <translation>erwartet</translation>
    </message>
    <message>
      <source>clear views a stem</source>
      <translation>freie Blicke je Stamm</translation>
    </message>
    <message>
      <source>trees</source>
      <translation>Bäume</translation>
    </message>
    <message>
      <source>without a DBH</source>
      <translation>ohne BHD</translation>
    </message>
    <message>
      <source>trees/ha</source>
      <translation>Bäume/ha</translation>
    </message>
    <message>
      <source>plot</source>
      <translation>Fläche</translation>
    </message>
    <message>
      <source>DBH</source>
      <translation>BHD</translation>
    </message>
    <message>
      <source>height</source>
      <translation>Höhe</translation>
    </message>
    <message>
      <source>counts as</source>
      <translation>zählt als</translation>
    </message>
    <message>
      <source>taped</source>
      <translation>mit dem Band gemessen</translation>
    </message>
    <message>
      <source>accepted</source>
      <translation>angenommen</translation>
    </message>
    <message>
      <source>no tree stands here</source>
      <translation>hier steht kein Baum</translation>
    </message>
    <message>
      <source>the same tree as another</source>
      <translation>derselbe Baum wie ein anderer</translation>
    </message>
    <message>
      <source>a stem stands here, DBH unknown</source>
      <translation>hier steht ein Stamm, BHD unbekannt</translation>
    </message>
    <message>
      <source>drawn at true scale</source>
      <translation>maßstäblich gezeichnet</translation>
    </message>
    <message>
      <source>Crown of tree</source>
      <translation>Krone von Baum</translation>
    </message>
    <message>
      <source>searched</source>
      <translation>abgesucht</translation>
    </message>
    <message>
      <source>at</source>
      <translation>in</translation>
    </message>
    <message>
      <source>points round</source>
      <translation>Punkte rundum</translation>
    </message>
    <message>
      <source>No DBH</source>
      <translation>Kein BHD</translation>
    </message>
    <message>
      <source>Parameter {name} is unknown to {algorithm}; {hint}</source>
      <translation>Der Parameter {name} ist {algorithm} unbekannt; {hint}</translation>
    </message>
    <message>
      <source>The rest can stay as it is.</source>
      <translation>Alles andere kann so bleiben.</translation>
    </message>
    <message>
      <source>{name}: found '{given}', expected one of {choices}.</source>
      <translation>{name}: '{given}' gefunden, erwartet ist eines von {choices}.</translation>
    </message>
    <message>
      <source>{names}: lies in a temporary folder, which QGIS deletes when it is closed; save it elsewhere.</source>
      <translation>{names}: liegt in einem temporären Ordner, den QGIS beim Schließen löscht; speichern Sie es anderswo.</translation>
    </message>
    <message>
      <source>Parameters</source>
      <translation>Parameter</translation>
    </message>
    <message>
      <source>Advanced parameters</source>
      <translation>Erweiterte Parameter</translation>
    </message>
    <message>
      <source>On the command line:</source>
      <translation>Auf der Befehlszeile:</translation>
    </message>
    <message>
      <source>Done in {time}.</source>
      <translation>Fertig nach {time}.</translation>
    </message>
    <message>
      <source>did you mean {name}?</source>
      <translation>meinten Sie {name}?</translation>
    </message>
    <message>
      <source>known: {names}.</source>
      <translation>bekannt: {names}.</translation>
    </message>
    <message>
      <source>You need: {names}.</source>
      <translation>Nötig: {names}.</translation>
    </message>
    <message>
      <source>Give if you have them: {names}.</source>
      <translation>Angeben, falls vorhanden: {names}.</translation>
    </message>
    <message>
      <source>Results</source>
      <translation>Ergebnisse</translation>
    </message>
    <message>
      <source>{name} is required: {help}</source>
      <translation>{name} ist erforderlich: {help}</translation>
    </message>
    <message>
      <source>{done} of {all} stems measured.</source>
      <translation>{done} von {all} Stämmen gemessen.</translation>
    </message>
    <message>
      <source>{name} is required: give a projected CRS in metres, like {zone}.</source>
      <translation>{name} ist erforderlich: geben Sie ein projiziertes KBS in Metern an, etwa {zone}.</translation>
    </message>
    <message>
      <source>{name}: '{given}' is not a coordinate reference system; give one like {zone}.</source>
      <translation>{name}: '{given}' ist kein Koordinatenbezugssystem; geben Sie eines wie {zone} an.</translation>
    </message>
    <message>
      <source>{name}: {crs} is not in metres; choose the metric version of this CRS or the UTM zone.</source>
      <translation>{name}: {crs} ist nicht in Metern; wählen Sie die metrische Fassung dieses KBS oder die UTM-Zone.</translation>
    </message>
    <message>
      <source>the photos in {folder}</source>
      <translation>die Fotos in {folder}</translation>
    </message>
    <message>
      <source>DTM: {dtm} covers x {west} to {east}, y {south} to {north}, but {what} lies at x {x}, y {y} ({crs}); give the terrain model of this place.</source>
      <translation>DTM: {dtm} reicht von x {west} bis {east}, y {south} bis {north}, aber {what} liegt bei x {x}, y {y} ({crs}); geben Sie das Geländemodell dieses Orts an.</translation>
    </message>
    <message>
      <source>{name}: {path} does not exist; give a file that does.</source>
      <translation>{name}: {path} gibt es nicht; geben Sie eine vorhandene Datei an.</translation>
    </message>
    <message>
      <source>{name}: {path} is a folder, expected a file.</source>
      <translation>{name}: {path} ist ein Ordner, erwartet ist eine Datei.</translation>
    </message>
    <message>
      <source>{name}: {path} is a file, expected a folder.</source>
      <translation>{name}: {path} ist eine Datei, erwartet ist ein Ordner.</translation>
    </message>
    <message>
      <source>{name}: a layer in memory cannot be written; give a file name.</source>
      <translation>{name}: ein Layer im Arbeitsspeicher kann nicht geschrieben werden; geben Sie einen Dateinamen an.</translation>
    </message>
    <message>
      <source>{name}: {path} ends in {found}, expected one of {wanted}.</source>
      <translation>{name}: {path} endet auf {found}, erwartet ist eines von {wanted}.</translation>
    </message>
    <message>
      <source>{name}: found '{given}', expected a whole number{unit}.</source>
      <translation>{name}: '{given}' gefunden, erwartet ist eine ganze Zahl{unit}.</translation>
    </message>
    <message>
      <source>{name}: found '{given}', expected a number{unit}.</source>
      <translation>{name}: '{given}' gefunden, erwartet ist eine Zahl{unit}.</translation>
    </message>
    <message>
      <source>{name}: found {given}, expected {limits}{unit}.</source>
      <translation>{name}: {given} gefunden, erwartet ist {limits}{unit}.</translation>
    </message>
    <message>
      <source>{name}: {crs} is geographic (degrees), expected a projected CRS in metres; use the UTM zone of your plot{zone}.</source>
      <translation>{name}: {crs} ist geographisch (Grad), erwartet ist ein projiziertes KBS in Metern; verwenden Sie die UTM-Zone Ihrer Probefläche{zone}.</translation>
    </message>
    <message>
      <source>DTM: {dtm} is not a raster that can be read; give a terrain GeoTIFF.</source>
      <translation>DTM: {dtm} ist kein lesbares Raster; geben Sie ein Gelände-GeoTIFF an.</translation>
    </message>
    <message>
      <source>{name}: {path} does not exist; give a folder that does.</source>
      <translation>{name}: {path} gibt es nicht; geben Sie einen vorhandenen Ordner an.</translation>
    </message>
    <message>
      <source>in {unit}</source>
      <translation>in {unit}</translation>
    </message>
    <message>
      <source>The TreeDGS engine is not set up yet ({takes}); {do}.</source>
      <translation>Der TreeDGS-Rechenkern ist noch nicht eingerichtet ({takes}); {do}.</translation>
    </message>
    <message>
      <source>Stopped; what was finished is kept, run again to resume.</source>
      <translation>Angehalten; was fertig war, bleibt erhalten, ein erneuter Start setzt fort.</translation>
    </message>
    <message>
      <source>No folder for the job's files can be made in {folder}; set TREEDGS_HOME to a folder that can be written.</source>
      <translation>In {folder} kann kein Ordner für die Dateien der Aufgabe angelegt werden; setzen Sie TREEDGS_HOME auf einen beschreibbaren Ordner.</translation>
    </message>
    <message>
      <source>The TreeDGS engine is missing: {source} names {python}, which is not a Python program; {do}.</source>
      <translation>Der TreeDGS-Rechenkern fehlt: {source} nennt {python}, das ist kein Python-Programm; {do}.</translation>
    </message>
    <message>
      <source>The TreeDGS engine needs Python 3.10 or newer: {python} ({source}) is {version}; {do}.</source>
      <translation>Der TreeDGS-Rechenkern braucht Python 3.10 oder neuer: {python} ({source}) ist {version}; {do}.</translation>
    </message>
    <message>
      <source>This algorithm needs a part of the engine that is not set up ({extras}); run 'Set up the engine' (treedgs:setupengine) once more and tick it ({names}).</source>
      <translation>Dieser Algorithmus braucht einen Teil des Rechenkerns, der nicht eingerichtet ist ({extras}); führen Sie „Rechenkern einrichten“ (treedgs:setupengine) noch einmal aus und haken Sie ihn an ({names}).</translation>
    </message>
    <message>
      <source>The TreeDGS engine is incomplete: {python} ({source}) lacks {names}; {do}.</source>
      <translation>Der TreeDGS-Rechenkern ist unvollständig: {python} ({source}) hat nicht: {names}; {do}.</translation>
    </message>
    <message>
      <source>The TreeDGS engine does not start: {python} ({source}) gave no answer ({problem}); {do}.</source>
      <translation>Der TreeDGS-Rechenkern startet nicht: {python} ({source}) gab keine Antwort ({problem}); {do}.</translation>
    </message>
    <message>
      <source>The engine cannot be started: {program} ({problem}); {do}.</source>
      <translation>Der Rechenkern kann nicht gestartet werden: {program} ({problem}); {do}.</translation>
    </message>
    <message>
      <source>The engine speaks protocol {found}, this plugin {own}; run 'Set up the engine' (treedgs:setupengine) to update it.</source>
      <translation>Der Rechenkern spricht Protokoll {found}, diese Erweiterung {own}; starten Sie 'Rechenkern einrichten' (treedgs:setupengine), um ihn zu aktualisieren.</translation>
    </message>
    <message>
      <source>{target}: has {count} characters; the libraries' own paths would be longer than Windows allows, expected at most {most}: set TREEDGS_HOME to a short folder like C:\treedgs.</source>
      <translation>{target}: hat {count} Zeichen; die Pfade der Bibliotheken würden länger, als Windows erlaubt, erwartet sind höchstens {most}: Setzen Sie TREEDGS_HOME auf einen kurzen Ordner wie C:\treedgs.</translation>
    </message>
    <message>
      <source>it touched memory it does not own</source>
      <translation>er griff auf fremden Speicher zu</translation>
    </message>
    <message>
      <source>the processor lacks an instruction it needs</source>
      <translation>dem Prozessor fehlt ein nötiger Befehl</translation>
    </message>
    <message>
      <source>a system library is missing, install the Visual C++ redistributable from https://aka.ms/vs/17/release/vc_redist.x64.exe</source>
      <translation>eine Systembibliothek fehlt, installieren Sie Visual C++ Redistributable von https://aka.ms/vs/17/release/vc_redist.x64.exe</translation>
    </message>
    <message>
      <source>it said nothing</source>
      <translation>er sagte nichts</translation>
    </message>
    <message>
      <source>The engine ended with code {code}: {last} (log: {log}).</source>
      <translation>Der Rechenkern endete mit Code {code}: {last} (Protokoll: {log}).</translation>
    </message>
    <message>
      <source>The engine was killed by the system, most likely because memory ran out; close other programs, choose a faster preset or fewer photos, and run again to resume (log: {log}).</source>
      <translation>Der Rechenkern wurde vom System beendet, wahrscheinlich weil der Arbeitsspeicher ausging; schließen Sie andere Programme, wählen Sie eine schnellere Voreinstellung oder weniger Fotos, und starten Sie erneut, um fortzusetzen (Protokoll: {log}).</translation>
    </message>
    <message>
      <source>The engine crashed ({name}); run 'Check the engine' (treedgs:checkengine), and if that is fine report the log {log}.</source>
      <translation>Der Rechenkern stürzte ab ({name}); starten Sie 'Rechenkern prüfen' (treedgs:checkengine), und wenn dort alles in Ordnung ist, melden Sie das Protokoll {log}.</translation>
    </message>
    <message>
      <source>The engine was stopped from outside; run again to resume (log: {log}).</source>
      <translation>Der Rechenkern wurde von außen angehalten; ein erneuter Start setzt fort (Protokoll: {log}).</translation>
    </message>
    <message>
      <source>The engine crashed: {why} (log: {log}).</source>
      <translation>Der Rechenkern stürzte ab: {why} (Protokoll: {log}).</translation>
    </message>
    <message>
      <source>Stand tables as Excel and PDF ({size})</source>
      <translation>Bestandestabellen als Excel und PDF ({size})</translation>
    </message>
    <message>
      <source>Simulated plots, dense points as PLY ({size})</source>
      <translation>Simulierte Plots, dichte Punkte als PLY ({size})</translation>
    </message>
    <message>
      <source>no NVIDIA card was found</source>
      <translation>es wurde keine NVIDIA-Karte gefunden</translation>
    </message>
    <message>
      <source>there is no NVIDIA driver on this computer</source>
      <translation>auf diesem Rechner gibt es keinen NVIDIA-Treiber</translation>
    </message>
    <message>
      <source>the NVIDIA driver does not answer ({answer})</source>
      <translation>der NVIDIA-Treiber antwortet nicht ({answer})</translation>
    </message>
    <message>
      <source>{name}: its driver is {driver}, expected {least} or newer; update it and run this again</source>
      <translation>{name}: der Treiber ist {driver}, erwartet ist {least} oder neuer; aktualisieren Sie ihn und starten Sie dies erneut</translation>
    </message>
    <message>
      <source>{name} is too old for the engine (compute capability {card}, expected {least})</source>
      <translation>{name} ist zu alt für den Rechenkern (Compute Capability {card}, erwartet {least})</translation>
    </message>
    <message>
      <source>{name} has {memory} MB of memory, expected {least}</source>
      <translation>{name} hat {memory} MB Speicher, erwartet sind {least}</translation>
    </message>
    <message>
      <source>{name}, driver {driver}</source>
      <translation>{name}, Treiber {driver}</translation>
    </message>
    <message>
      <source>{name}: the engine gets a copy of the layer '{layer}' as it shows it (features: {count}).</source>
      <translation>{name}: Der Rechenkern bekommt eine Kopie des Layers '{layer}', so wie er sie zeigt (Objekte: {count}).</translation>
    </message>
    <message>
      <source>{name}: {path} cannot be read as a layer; give a file that QGIS opens.</source>
      <translation>{name}: {path} lässt sich nicht als Layer lesen; geben Sie eine Datei an, die QGIS öffnet.</translation>
    </message>
    <message>
      <source>{name}: the layer '{layer}' has edits that are not saved; save or drop them first.</source>
      <translation>{name}: Der Layer '{layer}' hat ungespeicherte Änderungen; speichern oder verwerfen Sie sie zuerst.</translation>
    </message>
    <message>
      <source>{name}: all {count} features of '{layer}' are used, not only the {chosen} selected.</source>
      <translation>{name}: Alle {count} Objekte von '{layer}' werden verwendet, nicht nur die {chosen} ausgewählten.</translation>
    </message>
    <message>
      <source>{name}: the layer '{layer}' cannot be read; correct its source.</source>
      <translation>{name}: Der Layer '{layer}' lässt sich nicht lesen; berichtigen Sie seine Quelle.</translation>
    </message>
    <message>
      <source>{name}: the layer '{layer}' is no file on this computer; save it as a GeoTIFF first.</source>
      <translation>{name}: Der Layer '{layer}' ist keine Datei auf diesem Rechner; speichern Sie ihn zuerst als GeoTIFF.</translation>
    </message>
    <message>
      <source>{name}: the layer '{layer}' is filtered, or a copy without its trees; give the pairs' file.</source>
      <translation>{name}: Der Layer '{layer}' ist gefiltert oder eine Kopie ohne seine Bäume; geben Sie die Datei der Paare an.</translation>
    </message>
    <message>
      <source>{name}: the layer '{layer}' cannot be copied for the engine ({why}).</source>
      <translation>{name}: Der Layer '{layer}' lässt sich nicht für die Engine kopieren ({why}).</translation>
    </message>
    <message>
      <source>Camera positions</source>
      <translation>Kamerapositionen</translation>
    </message>
    <message>
      <source>Cameras from the photos</source>
      <translation>Kameras aus den Fotos</translation>
    </message>
    <message>
      <source>Photos matched where geotags and gimbal say</source>
      <translation>Fotos verglichen, wo Geotags und Gimbal es sagen</translation>
    </message>
    <message>
      <source>Photos matched again, where the first cameras say</source>
      <translation>Fotos noch einmal verglichen, wo die ersten Kameras es sagen</translation>
    </message>
    <message>
      <source>All photos matched anew</source>
      <translation>Alle Fotos neu verglichen</translation>
    </message>
    <message>
      <source>Features in each photo</source>
      <translation>Merkmale in jedem Foto</translation>
    </message>
    <message>
      <source>Same points in several photos</source>
      <translation>Gleiche Punkte in mehreren Fotos</translation>
    </message>
    <message>
      <source>First placing of the cameras</source>
      <translation>Erste Lage der Kameras</translation>
    </message>
    <message>
      <source>Fine adjustment of the cameras</source>
      <translation>Feinausgleichung der Kameras</translation>
    </message>
    <message>
      <source>Dense points</source>
      <translation>Dichte Punkte</translation>
    </message>
    <message>
      <source>Ground under the trees</source>
      <translation>Boden unter den Bäumen</translation>
    </message>
    <message>
      <source>Stems and their diameters</source>
      <translation>Stämme und ihre Durchmesser</translation>
    </message>
    <message>
      <source>Looking for stems</source>
      <translation>Suche nach Stämmen</translation>
    </message>
    <message>
      <source>Fitting each stem</source>
      <translation>Anpassung jedes Stamms</translation>
    </message>
    <message>
      <source>Asking the network for stems</source>
      <translation>Das Netz wird nach Stämmen gefragt</translation>
    </message>
    <message>
      <source>Measuring hidden stems farther up</source>
      <translation>Messung verdeckter Stämme weiter oben</translation>
    </message>
    <message>
      <source>Measuring each stem</source>
      <translation>Messung jedes Stamms</translation>
    </message>
    <message>
      <source>Stems, found and fitted</source>
      <translation>Stämme, gefunden und angepasst</translation>
    </message>
    <message>
      <source>Heights of the trees</source>
      <translation>Höhen der Bäume</translation>
    </message>
    <message>
      <source>Picture of the ground</source>
      <translation>Bild des Bodens</translation>
    </message>
    <message>
      <source>Stand in three dimensions</source>
      <translation>Bestand in drei Dimensionen</translation>
    </message>
    <message>
      <source>Looking for treetops</source>
      <translation>Suche nach Baumspitzen</translation>
    </message>
    <message>
      <source>Writing tagged copies of the photos</source>
      <translation>Schreiben verorteter Kopien der Fotos</translation>
    </message>
    <message>
      <source>Drawing trees</source>
      <translation>Bäume werden gezogen</translation>
    </message>
    <message>
      <source>Comparing with the tapes</source>
      <translation>Vergleich mit dem Bandmaß</translation>
    </message>
    <message>
      <source>Growing the stand</source>
      <translation>Der Bestand wächst</translation>
    </message>
    <message>
      <source>Drawing the photos</source>
      <translation>Zeichnen der Fotos</translation>
    </message>
    <message>
      <source>LiDAR cloud</source>
      <translation>LiDAR-Wolke</translation>
    </message>
    <message>
      <source>Writing field table and truth</source>
      <translation>Schreiben von Feldtabelle und Wahrheit</translation>
    </message>
    <message>
      <source>Comparing with the field trees</source>
      <translation>Vergleich mit den Feldbäumen</translation>
    </message>
    <message>
      <source>Published methods on the same trees</source>
      <translation>Veröffentlichte Verfahren an denselben Bäumen</translation>
    </message>
    <message>
      <source>Tables and figures of the paper</source>
      <translation>Tabellen und Abbildungen der Veröffentlichung</translation>
    </message>
    <message>
      <source>Circles and cylinders on both clouds</source>
      <translation>Kreise und Zylinder auf beiden Wolken</translation>
    </message>
    <message>
      <source>Photos that show breast height, and time</source>
      <translation>Fotos, die die Brusthöhe zeigen, und Zeit</translation>
    </message>
    <message>
      <source>Dense points to start from</source>
      <translation>Dichte Punkte für den Anfang</translation>
    </message>
    <message>
      <source>Stereo of neighbouring photos</source>
      <translation>Stereo aus benachbarten Fotos</translation>
    </message>
    <message>
      <source>Fitting Gaussians</source>
      <translation>Anpassung der Gauß-Elemente</translation>
    </message>
    <message>
      <source>Surface points</source>
      <translation>Oberflächenpunkte</translation>
    </message>
    <message>
      <source>Telling stems from the rest</source>
      <translation>Stämme vom Rest trennen</translation>
    </message>
    <message>
      <source>Reading the point cloud</source>
      <translation>Lesen der Punktwolke</translation>
    </message>
    <message>
      <source>Pairing field and measured trees</source>
      <translation>Paarung von Feld- und gemessenen Bäumen</translation>
    </message>
    <message>
      <source>Stems at the places given</source>
      <translation>Stämme an den angegebenen Stellen</translation>
    </message>
    <message>
      <source>Stems measured at places given before</source>
      <translation>Stämme, die vorher an gegebenen Stellen gemessen wurden</translation>
    </message>
    <message>
      <source>Comparing flights</source>
      <translation>Flüge werden verglichen</translation>
    </message>
    <message>
      <source>A picture of the evidence for each tree</source>
      <translation>Ein Bild der Belege zu jedem Baum</translation>
    </message>
    <message>
      <source>Compiling for this processor</source>
      <translation>Übersetzen für diesen Prozessor</translation>
    </message>
    <message>
      <source>Writing layer and report</source>
      <translation>Schreiben von Layer und Bericht</translation>
    </message>
    <message>
      <source>Reading the tables</source>
      <translation>Lesen der Tabellen</translation>
    </message>
    <message>
      <source>Estimating per hectare</source>
      <translation>Schätzung je Hektar</translation>
    </message>
    <message>
      <source>Stems in the photos, area {number} of {all}</source>
      <translation>Stämme in den Fotos, Gebiet {number} von {all}</translation>
    </message>
    <message>
      <source>Dense points of plot {plot}</source>
      <translation>Dichte Punkte der Probefläche {plot}</translation>
    </message>
    <message>
      <source>You may close this window: the run goes on, and its results come to the map.</source>
      <translation>Sie können dieses Fenster schließen: Der Lauf geht weiter, und seine Ergebnisse kommen auf die Karte.</translation>
    </message>
    <message>
      <source>about {time} left</source>
      <translation>noch etwa {time}</translation>
    </message>
    <message>
      <source>Plots</source>
      <translation>Probeflächen</translation>
    </message>
    <message>
      <source>Suggested pairs</source>
      <translation>Vorgeschlagene Paare</translation>
    </message>
    <message>
      <source>Measured trees</source>
      <translation>Gemessene Bäume</translation>
    </message>
    <message>
      <source>Field trees</source>
      <translation>Feldbäume</translation>
    </message>
    <message>
      <source>Plots searched</source>
      <translation>Abgesuchte Flächen</translation>
    </message>
    <message>
      <source>Crowns</source>
      <translation>Kronen</translation>
    </message>
    <message>
      <source>Stems at true scale</source>
      <translation>Stämme maßstäblich</translation>
    </message>
    <message>
      <source>Stem sections</source>
      <translation>Stammquerschnitte</translation>
    </message>
    <message>
      <source>Ground in the photos</source>
      <translation>Boden in den Fotos</translation>
    </message>
    <message>
      <source>Plots of the flight plan</source>
      <translation>Flächen des Flugplans</translation>
    </message>
    <message>
      <source>Flight line</source>
      <translation>Flugweg</translation>
    </message>
    <message>
      <source>Planned photos</source>
      <translation>Geplante Fotos</translation>
    </message>
    <message>
      <source>Stand by plot</source>
      <translation>Bestand je Fläche</translation>
    </message>
    <message>
      <source>Trees of the stand table</source>
      <translation>Bäume der Bestandestabelle</translation>
    </message>
    <message>
      <source>Trees at two dates</source>
      <translation>Bäume zu zwei Zeitpunkten</translation>
    </message>
    <message>
      <source>Taped trees</source>
      <translation>Gemessene Bäume (Maßband)</translation>
    </message>
    <message>
      <source>Ground</source>
      <translation>Gelände</translation>
    </message>
    <message>
      <source>Orthophoto of the ground</source>
      <translation>Orthofoto des Bodens</translation>
    </message>
    <message>
      <source>temporary</source>
      <translation>temporär</translation>
    </message>
    <message>
      <source>The engine is being set up; wait until the message bar says that it is set up, then press Run again.</source>
      <translation>Der Rechenkern wird gerade eingerichtet; warten Sie, bis die Meldungsleiste sagt, dass er eingerichtet ist, und drücken Sie dann noch einmal auf Starten.</translation>
    </message>
    <message>
      <source>run the algorithm 'Set up the engine' (in a shell: qgis_process run treedgs:setupengine), or point the environment variable TREEDGS_PYTHON at a Python that has the engine's libraries</source>
      <translation>starten Sie den Algorithmus 'Rechenkern einrichten' (in einer Shell: qgis_process run treedgs:setupengine), oder setzen Sie die Umgebungsvariable TREEDGS_PYTHON auf ein Python, das die Bibliotheken des Rechenkerns hat</translation>
    </message>
    <message>
      <source>{size}, {low}–{high} min</source>
      <translation>{size}, {low}–{high} min</translation>
    </message>
    <message>
      <source>From drone photos to a stand table</source>
      <translation>Von Drohnenfotos zur Bestandestabelle</translation>
    </message>
    <message>
      <source>From a point cloud to a stand table</source>
      <translation>Von der Punktwolke zur Bestandestabelle</translation>
    </message>
    <message>
      <source>From drone photos to accuracy against field trees</source>
      <translation>Von Drohnenfotos zur Genauigkeit gegen Feldbäume</translation>
    </message>
    <message>
      <source>Ready-made models</source>
      <translation>Fertige Modelle</translation>
    </message>
    <message>
      <source>Starting …</source>
      <translation>Beginnt …</translation>
    </message>
    <message>
      <source>Set up again</source>
      <translation>Neu einrichten</translation>
    </message>
    <message>
      <source>Stop</source>
      <translation>Anhalten</translation>
    </message>
    <message>
      <source>The engine is not set up ({takes}).</source>
      <translation>Der Rechenkern ist nicht eingerichtet ({takes}).</translation>
    </message>
    <message>
      <source>Add it now</source>
      <translation>Jetzt hinzufügen</translation>
    </message>
    <message>
      <source>Set up now</source>
      <translation>Jetzt einrichten</translation>
    </message>
    <message>
      <source>Open the report</source>
      <translation>Bericht öffnen</translation>
    </message>
    <message>
      <source>The engine is set up; the algorithms can run.</source>
      <translation>Der Rechenkern ist eingerichtet; die Algorithmen können laufen.</translation>
    </message>
    <message>
      <source>The engine is damaged; setting it up anew takes {takes}. Jobs and results stay.</source>
      <translation>Der Rechenkern ist beschädigt; ihn neu einzurichten braucht {takes}. Aufträge und Ergebnisse bleiben.</translation>
    </message>
    <message>
      <source>This needs a part of the engine that is not set up: {names} ({takes}).</source>
      <translation>Dies braucht einen Teil des Rechenkerns, der nicht eingerichtet ist: {names} ({takes}).</translation>
    </message>
    <message>
      <source>It failed; see the log.</source>
      <translation>Es ist fehlgeschlagen; siehe Protokoll.</translation>
    </message>
    <message>
      <source>No Python that will do was found, and none that could fetch one; install Python 3.12 (python.org) and run this again.</source>
      <translation>Es wurde kein geeignetes Python gefunden und keines, das eines holen könnte; installieren Sie Python 3.12 (python.org) und starten Sie noch einmal.</translation>
    </message>
    <message>
      <source>{what} could not be fetched; read the lines above, and check the network (behind a proxy set HTTPS_PROXY), or install Python 3.12 (python.org) and run this again.</source>
      <translation>{what} konnte nicht geholt werden; lesen Sie die Zeilen darüber und prüfen Sie das Netz (hinter einem Proxy setzen Sie HTTPS_PROXY), oder installieren Sie Python 3.12 (python.org) und starten Sie noch einmal.</translation>
    </message>
    <message>
      <source>No suitable Python is installed; getting Python {version} for the engine alone.</source>
      <translation>Kein geeignetes Python ist installiert; Python {version} wird eigens für den Rechenkern geholt.</translation>
    </message>
    <message>
      <source>{low} to {high}</source>
      <translation>{low} bis {high}</translation>
    </message>
    <message>
      <source>at least {low}</source>
      <translation>mindestens {low}</translation>
    </message>
    <message>
      <source>at most {high}</source>
      <translation>höchstens {high}</translation>
    </message>
    <message>
      <source>Preparing the libraries for a quick start</source>
      <translation>Bibliotheken werden für einen schnellen Start vorbereitet</translation>
    </message>
    <message>
      <source>Fetching {name} ({done} of {all} MB are here)</source>
      <translation>{name} wird geholt ({done} von {all} MB sind da)</translation>
    </message>
    <message>
      <source>Installing {name} ({number} of {all})</source>
      <translation>{name} wird installiert ({number} von {all})</translation>
    </message>
    <message>
      <source>A library that pip received is not the one that was tested (its hash differs); a proxy or a mirror may have changed it: try another network, or give a folder of wheels.</source>
      <translation>Eine Bibliothek, die pip erhielt, ist nicht die geprüfte (ihr Hash weicht ab); ein Proxy oder Spiegelserver hat sie vielleicht verändert: Versuchen Sie es über ein anderes Netz oder geben Sie einen Ordner mit Wheels an.</translation>
    </message>
    <message>
      <source>pip could not install {packages} into {target}; read the lines above: without network give a folder of wheels, behind a proxy set HTTPS_PROXY, then run this again.</source>
      <translation>pip konnte {packages} nicht in {target} installieren; lesen Sie die Zeilen darüber: ohne Netz geben Sie einen Ordner mit Wheels an, hinter einem Proxy setzen Sie HTTPS_PROXY, dann noch einmal ausführen.</translation>
    </message>
    <message>
      <source>The disk with {target} is full; make room or set TREEDGS_HOME to a larger disk.</source>
      <translation>Der Datenträger mit {target} ist voll; schaffen Sie Platz oder setzen Sie TREEDGS_HOME auf einen größeren.</translation>
    </message>
    <message>
      <source>{target}: a file is in use; close QGIS and other programs that run the engine, and run this again.</source>
      <translation>{target}: Eine Datei ist in Gebrauch; schließen Sie QGIS und andere Programme, die den Rechenkern ausführen, und starten Sie noch einmal.</translation>
    </message>
    <message>
      <source>{wheels}: has no wheel of {name} for Python {python} on this system; make the folder with this Python's version on the same system, or choose another Python (PYTHON).</source>
      <translation>{wheels}: enthält kein Wheel von {name} für Python {python} auf diesem System; füllen Sie den Ordner mit derselben Python-Version auf dem gleichen System, oder wählen Sie ein anderes Python (PYTHON).</translation>
    </message>
    <message>
      <source>{name} has no ready-made package (wheel) for this system ({system}, Python {python}); the engine runs on Windows x64, on Linux x86-64, and on macOS 15 or newer with an Apple processor. The network works.</source>
      <translation>{name} hat kein fertiges Paket (Wheel) für dieses System ({system}, Python {python}); der Rechenkern läuft unter Windows x64, Linux x86-64 und macOS 15 oder neuer mit Apple-Prozessor. Das Netz funktioniert.</translation>
    </message>
    <message>
      <source>{name} has no ready-made package (wheel) for Python {python} on this system; install Python 3.12 and name it (PYTHON), and run this again. The network works.</source>
      <translation>{name} hat kein fertiges Paket (Wheel) für Python {python} auf diesem System; installieren Sie Python 3.12, geben Sie es an (PYTHON) und starten Sie noch einmal. Das Netz funktioniert.</translation>
    </message>
    <message>
      <source>pip could not reach the package index to install {packages}; without network give a folder of wheels, behind a proxy set HTTPS_PROXY, then run this again.</source>
      <translation>pip konnte den Paketindex nicht erreichen, um {packages} zu installieren; ohne Netz geben Sie einen Ordner mit Wheels an, hinter einem Proxy setzen Sie HTTPS_PROXY, dann noch einmal ausführen.</translation>
    </message>
    <message>
      <source>Stem list</source>
      <translation>Stammliste</translation>
    </message>
    <message>
      <source>3D view of this plot</source>
      <translation>3D-Ansicht dieser Probefläche</translation>
    </message>
    <message>
      <source>Try it with a sample flight</source>
      <translation>Mit einem Beispielflug ausprobieren</translation>
    </message>
    <message>
      <source>No Python 3.10 or newer with venv was found; install one (Debian and Ubuntu: apt install python3-venv; Windows and macOS: python.org, version 3.12) and run this again.</source>
      <translation>Es wurde kein Python 3.10 oder neuer mit venv gefunden; installieren Sie eines (Debian und Ubuntu: apt install python3-venv; Windows und macOS: python.org, Version 3.12) und starten Sie noch einmal.</translation>
    </message>
    <message>
      <source>{path} is newer than the engine's libraries, which exist for Python 3.10 to 3.14; install one of these beside it and run this again.</source>
      <translation>{path} ist neuer als die Bibliotheken des Rechenkerns, die es für Python 3.10 bis 3.14 gibt; installieren Sie eines davon daneben und starten Sie noch einmal.</translation>
    </message>
    <message>
      <source>{path}: is not a Python 3.10 or newer with venv and ensurepip; install one or name another.</source>
      <translation>{path}: ist kein Python 3.10 oder neuer mit venv und ensurepip; installieren Sie eines oder geben Sie ein anderes an.</translation>
    </message>
    <message>
      <source>{file}: holds no run of photos ({problem}); measure the stem by tape.</source>
      <translation>{file}: enthält keinen Foto-Lauf ({problem}); messen Sie den Stamm mit dem Maßband.</translation>
    </message>
    <message>
      <source>{layer}: its run's workspace was not found; only a layer of photos beside its workspace can do this.</source>
      <translation>{layer}: der Arbeitsordner seines Laufs wurde nicht gefunden; das geht nur mit einem Foto-Layer neben seinem Arbeitsordner.</translation>
    </message>
    <message>
      <source>{layer}: is being edited; save the edits and end editing first.</source>
      <translation>{layer}: wird gerade bearbeitet; speichern Sie die Änderungen und beenden Sie zuerst die Bearbeitung.</translation>
    </message>
    <message>
      <source>nothing was measured; the log says why</source>
      <translation>es wurde nichts gemessen; das Protokoll sagt warum</translation>
    </message>
    <message>
      <source>Tree {tree}: taped {taped} cm, but measured {measured} cm. Is it this tree and this number? Press Taped DBH (D) again to keep it, or type another number.</source>
      <translation>Baum {tree}: mit dem Band {taped} cm, gemessen aber {measured} cm. Ist es dieser Baum und diese Zahl? BHD vom Maßband (D) noch einmal drücken, um sie zu behalten, oder eine andere Zahl eingeben.</translation>
    </message>
    <message>
      <source>The last step was taken back.</source>
      <translation>Der letzte Schritt wurde zurückgenommen.</translation>
    </message>
    <message>
      <source>Click on the map; the right button or Esc ends it.</source>
      <translation>Klicken Sie in die Karte; rechte Maustaste oder Esc beendet es.</translation>
    </message>
    <message>
      <source>Decided: {done} of {all} to check or without a DBH, {others} of the other {rest}.</source>
      <translation>Entschieden: {done} von {all} zu prüfenden oder ohne BHD, {others} der übrigen {rest}.</translation>
    </message>
    <message>
      <source>No other tree stands where you clicked; click on its symbol.</source>
      <translation>Dort steht kein anderer Baum; klicken Sie auf sein Symbol.</translation>
    </message>
    <message>
      <source>Another stem is being measured; wait for it.</source>
      <translation>Ein anderer Stamm wird gerade gemessen; warten Sie darauf.</translation>
    </message>
    <message>
      <source>No tree layer in the project: add trees.gpkg.</source>
      <translation>Kein Baumlayer im Projekt: fügen Sie trees.gpkg hinzu.</translation>
    </message>
    <message>
      <source>No such tree is left; choose 'all' to see every tree.</source>
      <translation>Kein solcher Baum ist mehr da; 'alle' zeigt jeden Baum.</translation>
    </message>
    <message>
      <source>{number} of {all}</source>
      <translation>{number} von {all}</translation>
    </message>
    <message>
      <source>Not decided yet.</source>
      <translation>Noch nicht entschieden.</translation>
    </message>
    <message>
      <source>Before: {meaning}; Undo last step (U) brings it back.</source>
      <translation>Vorher: {meaning}; Letzten Schritt rückgängig (U) stellt das wieder her.</translation>
    </message>
    <message>
      <source>Tree {tree} was added: a stem without a DBH.</source>
      <translation>Baum {tree} wurde hinzugefügt: ein Stamm ohne BHD.</translation>
    </message>
    <message>
      <source>Tree {tree} is being measured …</source>
      <translation>Baum {tree} wird gemessen …</translation>
    </message>
    <message>
      <source>Found '{text}', expected the number of a tree.</source>
      <translation>Gefunden: '{text}', erwartet: die Nummer eines Baums.</translation>
    </message>
    <message>
      <source>Before: {cm} cm; press As it was (W) to go back.</source>
      <translation>Vorher: {cm} cm; „Wie vorher (W)“ nimmt es zurück.</translation>
    </message>
    <message>
      <source>Tree {tree}: {taped} cm, but {known} cm in the layer; these look like millimetres, or the decimal point is elsewhere: type the diameter in centimetres.</source>
      <translation>Baum {tree}: {taped} cm, aber {known} cm im Layer; das sieht nach Millimetern aus, oder das Komma steht an anderer Stelle: geben Sie den Durchmesser in Zentimetern ein.</translation>
    </message>
    <message>
      <source>Taped DBH: found '{text}', expected {low} to {high} cm.</source>
      <translation>BHD mit Maßband: gefunden '{text}', erwartet {low} bis {high} cm.</translation>
    </message>
    <message>
      <source>Tree {tree}: taped {taped} cm, measured {measured} cm; check the number and that it is this tree.</source>
      <translation>Baum {tree}: Maßband {taped} cm, gemessen {measured} cm; prüfen Sie die Zahl und ob es dieser Baum ist.</translation>
    </message>
    <message>
      <source>{layer}: nothing was written ({why}); close other programs that use the file, or save a copy of it.</source>
      <translation>{layer}: es wurde nichts geschrieben ({why}); schließen Sie andere Programme, die die Datei benutzen, oder speichern Sie eine Kopie.</translation>
    </message>
    <message>
      <source>Tree {tree} cannot be the same as {other}; give the number of another tree of this layer.</source>
      <translation>Baum {tree} kann nicht derselbe sein wie {other}; geben Sie die Nummer eines anderen Baums dieses Layers an.</translation>
    </message>
    <message>
      <source>Tree {other} counts nowhere itself (rejected, or merged): one of the two has to count.</source>
      <translation>Baum {other} zählt selbst nirgends (abgelehnt oder zusammengelegt): einer der beiden muss zählen.</translation>
    </message>
    <message>
      <source>Tree {tree} stands {away} m from here; decide about that tree.</source>
      <translation>Baum {tree} steht {away} m von hier; entscheiden Sie über jenen Baum.</translation>
    </message>
    <message>
      <source>This place lies {away} m from the nearest tree of the layer; click inside the plot.</source>
      <translation>Diese Stelle liegt {away} m vom nächsten Baum des Layers; klicken Sie in die Fläche.</translation>
    </message>
    <message>
      <source>here stands a stem</source>
      <translation>hier steht ein Stamm</translation>
    </message>
    <message>
      <source>the file cannot be changed</source>
      <translation>die Datei lässt sich nicht ändern</translation>
    </message>
    <message>
      <source>Tree {other} is merged into tree {tree}, which therefore has to count; change that one first.</source>
      <translation>Baum {other} ist mit Baum {tree} zusammengelegt, der deshalb zählen muss; ändern Sie zuerst jenen.</translation>
    </message>
    <message>
      <source>Tree {tree} has no DBH: it counts as a tree without one; give its taped DBH if you have it.</source>
      <translation>Baum {tree} hat keinen BHD: er zählt als Baum ohne BHD; geben Sie den BHD vom Maßband an, wenn Sie ihn haben.</translation>
    </message>
    <message>
      <source>Click the picture to see it in full size.</source>
      <translation>Klicken Sie auf das Bild, um es in voller Größe zu sehen.</translation>
    </message>
    <message>
      <source>Accept (A)</source>
      <translation>Annehmen (A)</translation>
    </message>
    <message>
      <source>No tree here (X)</source>
      <translation>Hier kein Baum (X)</translation>
    </message>
    <message>
      <source>Taped DBH (D)</source>
      <translation>BHD vom Maßband (D)</translation>
    </message>
    <message>
      <source>Same tree as (M)</source>
      <translation>Derselbe Baum wie (M)</translation>
    </message>
    <message>
      <source>pick on the map</source>
      <translation>in der Karte wählen</translation>
    </message>
    <message>
      <source>Here stands a stem (S)</source>
      <translation>Hier steht ein Stamm (S)</translation>
    </message>
    <message>
      <source>Its foot is here: measure again (B)</source>
      <translation>Sein Fuß ist hier: noch einmal messen (B)</translation>
    </message>
    <message>
      <source>As it was (W)</source>
      <translation>Wie vorher (W)</translation>
    </message>
    <message>
      <source>measure it in the photos at once</source>
      <translation>gleich in den Fotos messen</translation>
    </message>
    <message>
      <source>Save note</source>
      <translation>Notiz speichern</translation>
    </message>
    <message>
      <source>Take decision back (C)</source>
      <translation>Entscheidung zurücknehmen (C)</translation>
    </message>
    <message>
      <source>Undo last step (U)</source>
      <translation>Letzten Schritt rückgängig (U)</translation>
    </message>
    <message>
      <source>a note (goes with the decision)</source>
      <translation>eine Notiz (gehört zur Entscheidung)</translation>
    </message>
    <message>
      <source>DBH, cm</source>
      <translation>BHD, cm</translation>
    </message>
    <message>
      <source>number</source>
      <translation>Nummer</translation>
    </message>
    <message>
      <source>No evidence sheet of this tree was found beside the layer.</source>
      <translation>Neben dem Layer wurde kein Belegblatt dieses Baums gefunden.</translation>
    </message>
    <message>
      <source>only those not decided yet</source>
      <translation>nur noch nicht entschiedene</translation>
    </message>
    <message>
      <source>◀ Previous (P)</source>
      <translation>◀ Zurück (P)</translation>
    </message>
    <message>
      <source>Next (N) ▶</source>
      <translation>Weiter (N) ▶</translation>
    </message>
    <message>
      <source>Zoom to (Z)</source>
      <translation>Heranzoomen (Z)</translation>
    </message>
    <message>
      <source>The tree and its DBH are right.</source>
      <translation>Der Baum und sein BHD stimmen.</translation>
    </message>
    <message>
      <source>No tree stands here; it counts nowhere.</source>
      <translation>Hier steht kein Baum; er zählt nirgends.</translation>
    </message>
    <message>
      <source>Its DBH was taped: type it in cm. The measured one stays beside it.</source>
      <translation>Sein BHD wurde mit dem Maßband gemessen: in cm eingeben. Der gemessene bleibt daneben stehen.</translation>
    </message>
    <message>
      <source>This is the same tree as another one, which counts.</source>
      <translation>Das ist derselbe Baum wie ein anderer, der zählt.</translation>
    </message>
    <message>
      <source>Click on the map where a stem stands that the layer does not have.</source>
      <translation>Klicken Sie in der Karte dorthin, wo ein Stamm steht, den der Layer nicht hat.</translation>
    </message>
    <message>
      <source>Click on the map where the foot of this stem is; it is measured there in the photos.</source>
      <translation>Auf der Karte dorthin klicken, wo der Fuß dieses Stamms ist; dort wird er in den Fotos gemessen.</translation>
    </message>
    <message>
      <source>Take the tree back to what it was before it was measured again.</source>
      <translation>Den Baum auf den Stand vor der neuen Messung zurücksetzen.</translation>
    </message>
    <message>
      <source>Take the decision about this tree back.</source>
      <translation>Die Entscheidung über diesen Baum zurücknehmen.</translation>
    </message>
    <message>
      <source>Take back what was done last in this panel.</source>
      <translation>Zurücknehmen, was zuletzt in diesem Fenster geschah.</translation>
    </message>
    <message>
      <source>Show</source>
      <translation>Zeigen</translation>
    </message>
    <message>
      <source>measured, to be checked</source>
      <translation>gemessen, zu prüfen</translation>
    </message>
    <message>
      <source>to be checked, or without a DBH</source>
      <translation>zu prüfen oder ohne BHD</translation>
    </message>
    <message>
      <source>to be checked</source>
      <translation>zu prüfen</translation>
    </message>
    <message>
      <source>measured, nothing against them</source>
      <translation>gemessen, nichts spricht dagegen</translation>
    </message>
    <message>
      <source>decided by a person</source>
      <translation>von einer Person entschieden</translation>
    </message>
    <message>
      <source>all</source>
      <translation>alle</translation>
    </message>
    <message>
      <source>No DBH was measured.</source>
      <translation>Es wurde kein BHD gemessen.</translation>
    </message>
    <message>
      <source>Decided: {meaning}</source>
      <translation>Entschieden: {meaning}</translation>
    </message>
    <message>
      <source>plot {plot}</source>
      <translation>Fläche {plot}</translation>
    </message>
    <message>
      <source>{count} photos see it</source>
      <translation>{count} Fotos sehen ihn</translation>
    </message>
    <message>
      <source>{count} slices</source>
      <translation>{count} Scheiben</translation>
    </message>
    <message>
      <source>leans {angle}°</source>
      <translation>Neigung {angle}°</translation>
    </message>
    <message>
      <source>{height} m tall</source>
      <translation>{height} m hoch</translation>
    </message>
    <message>
      <source>The sample flight did not come with this copy of the plugin; run: make sample</source>
      <translation>Der Beispielflug liegt dieser Kopie der Erweiterung nicht bei; ausführen: make sample</translation>
    </message>
    <message>
      <source>{folder}: the sample flight cannot be written ({problem}); give another FOLDER.</source>
      <translation>{folder}: Der Beispielflug kann nicht geschrieben werden ({problem}); geben Sie einen anderen FOLDER an.</translation>
    </message>
    <message>
      <source>Stems so far</source>
      <translation>Bisherige Stämme</translation>
    </message>
    <message>
      <source>The sample flight was measured before.</source>
      <translation>Der Beispielflug wurde schon gemessen.</translation>
    </message>
    <message>
      <source>{layer}: this QGIS opens no 3D view by itself; take View ▸ New 3D Map View, and there give Configure ▸ Terrain the terrain model.</source>
      <translation>{layer}: Dieses QGIS öffnet von sich aus keine 3D-Ansicht; wählen Sie Ansicht ▸ Neue 3D-Kartenansicht und geben Sie dort unter Konfigurieren ▸ Gelände das Geländemodell an.</translation>
    </message>
    <message>
      <source>Plan the flight</source>
      <translation>Flug planen</translation>
    </message>
    <message>
      <source>1 Plan</source>
      <translation>1 Planen</translation>
    </message>
    <message>
      <source>What to fly for a wanted error here: the flight with the fewest photos, as mission files and a brief.</source>
      <translation>Was hier für einen gewünschten Fehler zu fliegen ist: der Flug mit den wenigsten Fotos, als Missionsdateien und Einsatzblatt.</translation>
    </message>
    <message>
      <source>Compares flights over the plots (orbits, crosshatch, nadir with oblique lines; two heights, two tilts, several densities) by a model of what crowns and stems leave to be seen at breast height, and takes the one with the fewest photos that reaches the wanted standard error and share of stems. The stand is described by a canopy height model, a LiDAR cloud, the tree layer of an earlier visit, or five numbers. The flight follows the terrain, keeps its clearance over the canopy everywhere, and is as fast as trigger, blur and rolling shutter allow; what cannot be flown safely is refused. Heights in the mission files are over the take-off. Writes plan.kmz (DJI), plan.plan (QGroundControl), plan_litchi_1.csv, plan.gpkg (photos, way, footprints, plots with what is expected), brief.pdf and brief.html. Expectations are a model's; after the flight photos-to-dbh, given the plan, reports planned against got. Rules of the air and the pilot's eyes come first.</source>
      <translation>Vergleicht Flüge über den Probekreisen (Umkreisungen, Kreuzgitter, senkrechte mit schrägen Linien; zwei Höhen, zwei Neigungen, mehrere Dichten) mit einem Modell dessen, was Kronen und Stämme in Brusthöhe sehen lassen, und nimmt den mit den wenigsten Fotos, der den gewünschten Standardfehler und Anteil der Stämme erreicht. Den Bestand beschreibt ein Kronenhöhenmodell, eine LiDAR-Punktwolke, die Baumebene eines früheren Besuchs oder fünf Zahlen. Der Flug folgt dem Gelände, hält überall seinen Abstand zu den Kronen und ist so schnell, wie Auslösung, Unschärfe und Rollverschluss erlauben; was nicht sicher zu fliegen ist, wird abgelehnt. Höhen in den Missionsdateien gelten über dem Startplatz. Schreibt plan.kmz (DJI), plan.plan (QGroundControl), plan_litchi_1.csv, plan.gpkg (Fotos, Weg, Bildflächen, Probekreise mit dem Erwarteten), brief.pdf und brief.html. Erwartungen sind die eines Modells; nach dem Flug berichtet photos-to-dbh, wenn es den Plan bekommt, Geplantes gegen Erreichtes. Luftrecht und die Augen des Piloten gehen vor.</translation>
    </message>
    <message>
      <source>plots to photograph: CSV as for stand-table, or polygons</source>
      <translation>zu fotografierende Probekreise: CSV wie für stand-table, oder Polygone</translation>
    </message>
    <message>
      <source>DTM</source>
      <translation>Geländemodell (DGM)</translation>
    </message>
    <message>
      <source>terrain model; without one the ground is taken as level</source>
      <translation>Geländemodell; ohne gilt der Boden als eben</translation>
    </message>
    <message>
      <source>Canopy heights, cloud or trees there</source>
      <translation>Kronenhöhen, Wolke oder Bäume dort</translation>
    </message>
    <message>
      <source>what stands there: canopy height model (GeoTIFF), LiDAR cloud, or tree layer of an earlier visit; what it does not say comes from the numbers below</source>
      <translation>was dort steht: Kronenhöhenmodell (GeoTIFF), LiDAR-Punktwolke oder Baumebene eines früheren Besuchs; was sie nicht sagt, kommt aus den Zahlen unten</translation>
    </message>
    <message>
      <source>Camera</source>
      <translation>Kamera</translation>
    </message>
    <message>
      <source>camera: m3e, m3m, m4e, p4rtk, p1-35, mini4pro, air3, a photo of it, or width,height,focal in pixels, and where known the shortest time between two photos in s and the rolling shutter in ms</source>
      <translation>Kamera: m3e, m3m, m4e, p4rtk, p1-35, mini4pro, air3, ein Foto von ihr, oder Breite,Höhe,Brennweite in Pixeln; wo bekannt dazu die kürzeste Zeit zwischen zwei Fotos in s und der Rolling Shutter in ms</translation>
    </message>
    <message>
      <source>Target error [cm]</source>
      <translation>Zielfehler [cm]</translation>
    </message>
    <message>
      <source>wanted standard error of a DBH, median of the stems</source>
      <translation>gewünschter Standardfehler eines BHD, Median der Stämme</translation>
    </message>
    <message>
      <source>Target share [%]</source>
      <translation>Zielanteil [%]</translation>
    </message>
    <message>
      <source>wanted share of the stems that get a DBH</source>
      <translation>gewünschter Anteil der Stämme, die einen BHD bekommen</translation>
    </message>
    <message>
      <source>Batteries</source>
      <translation>Akkus</translation>
    </message>
    <message>
      <source>instead of the targets: the best flight with so many batteries</source>
      <translation>statt der Ziele: der beste Flug mit so vielen Akkus</translation>
    </message>
    <message>
      <source>Stems [1/ha]</source>
      <translation>Stämme [1/ha]</translation>
    </message>
    <message>
      <source>stems a hectare, where nothing maps them</source>
      <translation>Stämme je Hektar, wo nichts sie kartiert</translation>
    </message>
    <message>
      <source>DBH mean [cm]</source>
      <translation>Mittlerer BHD [cm]</translation>
    </message>
    <message>
      <source>mean DBH</source>
      <translation>mittlerer BHD</translation>
    </message>
    <message>
      <source>DBH standard deviation [cm]</source>
      <translation>Standardabweichung des BHD [cm]</translation>
    </message>
    <message>
      <source>standard deviation of the DBHs</source>
      <translation>Standardabweichung der BHD</translation>
    </message>
    <message>
      <source>Tree height [m]</source>
      <translation>Baumhöhe [m]</translation>
    </message>
    <message>
      <source>mean height of the trees</source>
      <translation>mittlere Höhe der Bäume</translation>
    </message>
    <message>
      <source>Crown base [m]</source>
      <translation>Kronenansatz [m]</translation>
    </message>
    <message>
      <source>mean height of the lowest living branches</source>
      <translation>mittlere Höhe der untersten grünen Äste</translation>
    </message>
    <message>
      <source>Take off</source>
      <translation>Startplatz</translation>
    </message>
    <message>
      <source>place of the take-off, easting,northing in the CRS of the plan; all heights in the mission files are over it; default: the most open place near the plots</source>
      <translation>Startplatz, Ost,Nord im KBS des Plans; alle Höhen in den Missionsdateien gelten über ihm; Vorgabe: der offenste Platz bei den Probekreisen</translation>
    </message>
    <message>
      <source>Output</source>
      <translation>Ausgabe</translation>
    </message>
    <message>
      <source>folder for the plan's files</source>
      <translation>Ordner für die Dateien des Plans</translation>
    </message>
    <message>
      <source>Leaf area index</source>
      <translation>Blattflächenindex</translation>
    </message>
    <message>
      <source>one-sided leaf area over ground area; default: from a LiDAR cloud, else 2.5</source>
      <translation>einseitige Blattfläche je Bodenfläche; Vorgabe: aus einer LiDAR-Punktwolke, sonst 2,5</translation>
    </message>
    <message>
      <source>Exposure [ms]</source>
      <translation>Belichtungszeit [ms]</translation>
    </message>
    <message>
      <source>shutter: 1 ms is 1/1000 s</source>
      <translation>Verschluss: 1 ms ist 1/1000 s</translation>
    </message>
    <message>
      <source>Speed [m/s]</source>
      <translation>Geschwindigkeit [m/s]</translation>
    </message>
    <message>
      <source>most speed to fly at</source>
      <translation>höchste Fluggeschwindigkeit</translation>
    </message>
    <message>
      <source>Distance kept from the crowns [m]</source>
      <translation>Abstand von den Kronen [m]</translation>
    </message>
    <message>
      <source>least height over the canopy, anywhere on the way</source>
      <translation>kleinste Höhe über den Kronen, überall auf dem Weg</translation>
    </message>
    <message>
      <source>Highest flight over the ground [m]</source>
      <translation>Größte Flughöhe über dem Boden [m]</translation>
    </message>
    <message>
      <source>most height over the ground, by law or permit</source>
      <translation>größte Höhe über dem Boden, nach Gesetz oder Genehmigung</translation>
    </message>
    <message>
      <source>Flight date</source>
      <translation>Flugtag</translation>
    </message>
    <message>
      <source>day of the flight, year-month-day, for the sun; default: today</source>
      <translation>Tag des Fluges, Jahr-Monat-Tag, für die Sonne; Vorgabe: heute</translation>
    </message>
    <message>
      <source>CRS</source>
      <translation>KBS</translation>
    </message>
    <message>
      <source>CRS of the plan, in metres; default: that of the DTM, or of the plots</source>
      <translation>KBS des Plans, in Metern; Vorgabe: das des DGM oder der Probekreise</translation>
    </message>
    <message>
      <source>Pattern</source>
      <translation>Muster</translation>
    </message>
    <message>
      <source>pattern of the flight; auto: whichever needs the fewest photos</source>
      <translation>Muster des Fluges; auto: das mit den wenigsten Fotos</translation>
    </message>
    <message>
      <source>the plan's folder</source>
      <translation>Ordner des Plans</translation>
    </message>
    <message>
      <source>the plan as layers (GeoPackage)</source>
      <translation>der Plan als Ebenen (GeoPackage)</translation>
    </message>
    <message>
      <source>mission for DJI Pilot 2 (WPML)</source>
      <translation>Mission für DJI Pilot 2 (WPML)</translation>
    </message>
    <message>
      <source>mission for QGroundControl</source>
      <translation>Mission für QGroundControl</translation>
    </message>
    <message>
      <source>mission for Litchi (the first file)</source>
      <translation>Mission für Litchi (die erste Datei)</translation>
    </message>
    <message>
      <source>brief for the crew (PDF)</source>
      <translation>Einsatzblatt für die Mannschaft (PDF)</translation>
    </message>
    <message>
      <source>the same as a page</source>
      <translation>dasselbe als Seite</translation>
    </message>
    <message>
      <source>photos</source>
      <translation>Fotos</translation>
    </message>
    <message>
      <source>pattern of the flight</source>
      <translation>Muster des Fluges</translation>
    </message>
    <message>
      <source>height over the ground, metres</source>
      <translation>Höhe über dem Boden, Meter</translation>
    </message>
    <message>
      <source>heading of the lines, degrees from grid north</source>
      <translation>Richtung der Linien, Grad von Gitternord</translation>
    </message>
    <message>
      <source>expected share of the stems with a DBH</source>
      <translation>erwarteter Anteil der Stämme mit BHD</translation>
    </message>
    <message>
      <source>expected standard error of a DBH, median, cm</source>
      <translation>erwarteter Standardfehler eines BHD, Median, cm</translation>
    </message>
    <message>
      <source>expected clear views a stem, mean</source>
      <translation>erwartete freie Blicke je Stamm, Mittel</translation>
    </message>
    <message>
      <source>minutes in the air</source>
      <translation>Minuten in der Luft</translation>
    </message>
    <message>
      <source>batteries</source>
      <translation>Akkus</translation>
    </message>
    <message>
      <source>gigabytes of photos</source>
      <translation>Gigabyte an Fotos</translation>
    </message>
    <message>
      <source>seconds to process on one thread</source>
      <translation>Sekunden der Auswertung auf einem Thread</translation>
    </message>
    <message>
      <source>speed, metres a second</source>
      <translation>Geschwindigkeit, Meter je Sekunde</translation>
    </message>
    <message>
      <source>lowest height over the canopy, metres</source>
      <translation>kleinste Höhe über den Kronen, Meter</translation>
    </message>
    <message>
      <source>share of the stems with 20 photos more</source>
      <translation>Anteil der Stämme mit 20 Fotos mehr</translation>
    </message>
    <message>
      <source>standard error with 20 photos more, cm</source>
      <translation>Standardfehler mit 20 Fotos mehr, cm</translation>
    </message>
    <message>
      <source>Measure DBH from drone photos</source>
      <translation>BHD aus Drohnenfotos messen</translation>
    </message>
    <message>
      <source>2 Measure</source>
      <translation>2 Messen</translation>
    </message>
    <message>
      <source>Drone photos (and PPK geotags) in, tree points with DBH, error and reasons out.</source>
      <translation>Drohnenfotos (und PPK-Geotags) hinein, Baumpunkte mit BHD, Fehler und Gründen heraus.</translation>
    </message>
    <message>
      <source>Inputs: overlapping drone photos taken above the canopy, most of them oblique (30 to 50 degrees from straight down), at about 2 cm a pixel or finer; PPK or RTK geotags. Output: one point per stem found, with DBH (cm), its standard error and 90 % interval (cm), and a reason wherever no DBH could be measured. Stems under 7.5 cm and stems that fewer than three photos see at breast height are refused. A second run in the same workspace resumes. Errors and limits were calibrated on rendered and simulated plots, mostly pines; no photo of a tree that somebody taped has been measured yet. A network trained on TreeDGS's own simulator decides which pixels show stems and which ivy. Tape some trees: they say how right the diameters are.</source>
      <translation>Eingaben: überlappende Drohnenfotos von oberhalb des Kronendachs, die meisten schräg (30 bis 50 Grad aus der Senkrechten), mit etwa 2 cm je Pixel oder feiner; PPK- oder RTK-Geotags. Ausgabe: ein Punkt je gefundenem Stamm mit BHD (cm), dessen Standardfehler und 90-%-Intervall (cm), und einem Grund, wo kein BHD messbar war. Stämme unter 7,5 cm und solche, die weniger als drei Fotos in Brusthöhe sehen, werden verworfen. Ein zweiter Lauf im selben Arbeitsordner setzt fort. Fehler und Grenzen wurden an gerenderten und simulierten Probeflächen bestimmt, meist mit Kiefern; noch wurde kein Foto eines Baums gemessen, den jemand mit dem Maßband gemessen hat. Ein Netz, das am Simulator von TreeDGS trainiert wurde, entscheidet, welche Pixel Stämme und welche Efeu zeigen. Messen Sie einige Bäume mit dem Maßband: sie sagen, wie richtig die Durchmesser sind.</translation>
    </message>
    <message>
      <source>Photos</source>
      <translation>Fotos</translation>
    </message>
    <message>
      <source>Folder with the original drone photos (JPEG) of one plot or block.</source>
      <translation>Ordner mit den originalen Drohnenfotos (JPEG) einer Probefläche oder eines Blocks.</translation>
    </message>
    <message>
      <source>Geotags</source>
      <translation>Geotags</translation>
    </message>
    <message>
      <source>Folder or file with MRK and RTKLIB .pos (PPK), or a CSV; without it EXIF/XMP positions are used.</source>
      <translation>Ordner oder Datei mit MRK und RTKLIB-.pos (PPK) oder eine CSV; sonst gelten die Positionen aus EXIF/XMP.</translation>
    </message>
    <message>
      <source>CSV of plots: plot_id, easting, northing, radius_m (or lon, lat); without it all that photos see well.</source>
      <translation>CSV der Probeflächen: plot_id, easting, northing, radius_m (oder lon, lat); sonst alles, was die Fotos gut sehen.</translation>
    </message>
    <message>
      <source>Project CRS, projected and in metres, for example EPSG:6344, or with a height datum, EPSG:6344+5703; default: the one that is usual where the photos lie; the log names it and says why</source>
      <translation>KBS des Projekts, projiziert und in Metern, zum Beispiel EPSG:6344, oder mit Höhendatum EPSG:6344+5703; Vorgabe: das dort übliche, wo die Fotos liegen; das Protokoll nennt es und sagt, warum</translation>
    </message>
    <message>
      <source>Terrain model (GeoTIFF) in the heights of the geotags; without it the ground is found in the photos.</source>
      <translation>Geländemodell (GeoTIFF) in den Höhen der Geotags; ohne es wird der Boden in den Fotos gesucht.</translation>
    </message>
    <message>
      <source>Dry run</source>
      <translation>Probelauf</translation>
    </message>
    <message>
      <source>Only check inputs, overlap, fixed positions, memory and disk, and estimate the time; writes nothing.</source>
      <translation>Nur Eingaben, Überlappung, fixierte Positionen, Speicher und Platte prüfen und die Zeit schätzen; schreibt nichts.</translation>
    </message>
    <message>
      <source>Workspace</source>
      <translation>Arbeitsordner</translation>
    </message>
    <message>
      <source>Folder for intermediate results; a second run resumes there. Not given: beside the photos, NAME_treedgs.</source>
      <translation>Ordner für Zwischenergebnisse; ein zweiter Lauf setzt dort fort. Nicht angegeben: neben den Fotos, NAME_treedgs.</translation>
    </message>
    <message>
      <source>Tree layer to write (.gpkg, .shp, .geojson or .csv).</source>
      <translation>Zu schreibender Baumlayer (.gpkg, .shp, .geojson oder .csv).</translation>
    </message>
    <message>
      <source>Geotags CRS</source>
      <translation>KBS der Geotags</translation>
    </message>
    <message>
      <source>Reference frame of the geotags (geographic), for example EPSG:7912 for ITRF2014; default: the project's.</source>
      <translation>Bezugsrahmen der Geotags (geographisch), zum Beispiel EPSG:7912 für ITRF2014; Vorgabe: der des Projekts.</translation>
    </message>
    <message>
      <source>Ground control points</source>
      <translation>Passpunkte</translation>
    </message>
    <message>
      <source>Ground control and check points: gcp_list.txt of OpenDroneMap, or CSV with label, easting, northing, height (or lon, lat, height), photo, u, v; for drones without PPK, for photos without any position (three or more points), and to check any block. In a CSV also known lengths between two marked points (bar, length_m), for the scale.</source>
      <translation>Pass- und Kontrollpunkte: gcp_list.txt von OpenDroneMap oder CSV mit label, easting, northing, height (oder lon, lat, height), photo, u, v; für Drohnen ohne PPK, für Fotos ohne jede Position (drei oder mehr Punkte) und zum Prüfen jedes Blocks. In einer CSV auch bekannte Längen zwischen zwei markierten Punkten (bar, length_m), für den Maßstab.</translation>
    </message>
    <message>
      <source>Calibration</source>
      <translation>Kalibrierung</translation>
    </message>
    <message>
      <source>camera.json of an earlier reconstruction with the same camera and photo size; without it the lens is taken from the photos' metadata.</source>
      <translation>camera.json einer früheren Rekonstruktion mit derselben Kamera und Fotogröße; ohne sie gelten die Objektivdaten aus den Metadaten der Fotos.</translation>
    </message>
    <message>
      <source>Field stems</source>
      <translation>Stämme der Feldaufnahme</translation>
    </message>
    <message>
      <source>Stems that a field crew knows: a point layer, or CSV with x, y or lon, lat and tree_id; each that the search does not find by itself is looked for at its place, and ends as a tree or with the reason why not.</source>
      <translation>Stämme, die ein Feldtrupp kennt: ein Punktlayer oder eine CSV mit x, y oder lon, lat und tree_id; jeder, den die Suche nicht selbst findet, wird an seiner Stelle gesucht und endet als Baum oder mit dem Grund, warum nicht.</translation>
    </message>
    <message>
      <source>Field error [m]</source>
      <translation>Feldfehler [m]</translation>
    </message>
    <message>
      <source>How far a place of --field-stems or --at may be from its stem.</source>
      <translation>Wie weit eine Stelle von --field-stems oder --at von ihrem Stamm entfernt sein darf.</translation>
    </message>
    <message>
      <source>Only at these points of a finished run</source>
      <translation>Nur an diesen Punkten eines fertigen Laufs</translation>
    </message>
    <message>
      <source>Measure the stems at these points (layer or CSV as for --field-stems) from the finished run in the workspace, in seconds, and add them to its tree layer; the other settings have to be those of that run. A point named 'again 12' measures tree 12 anew with its foot there, 'former 12' takes that back.</source>
      <translation>Misst die Stämme an diesen Punkten (Layer oder CSV wie bei --field-stems) aus dem fertigen Lauf im Arbeitsordner, in Sekunden, und fügt sie seinem Baumlayer hinzu; die übrigen Einstellungen müssen die jenes Laufs sein. Ein Punkt mit dem Namen 'again 12' misst Baum 12 neu, mit dem Fuß an dieser Stelle; 'former 12' nimmt das zurück.</translation>
    </message>
    <message>
      <source>Flight plan (plan.gpkg of plan-flight) that was flown: planned and got are compared.</source>
      <translation>Flugplan (plan.gpkg von plan-flight), der geflogen wurde: Geplantes und Erreichtes werden verglichen.</translation>
    </message>
    <message>
      <source>Preset</source>
      <translation>Voreinstellung</translation>
    </message>
    <message>
      <source>How much is modelled: fast and best differ in photos and features used; paper = the published method on the whole plot (hours).</source>
      <translation>Wie viel modelliert wird: fast und best unterscheiden sich in genutzten Fotos und Merkmalen; paper = das veröffentlichte Verfahren auf der ganzen Probefläche (Stunden).</translation>
    </message>
    <message>
      <source>Way of measuring</source>
      <translation>Messverfahren</translation>
    </message>
    <message>
      <source>auto, photos = stems fitted straight to the photos; gaussians, paper = the published method.</source>
      <translation>auto, photos = Stämme direkt in den Fotos angepasst; gaussians, paper = das veröffentlichte Verfahren.</translation>
    </message>
    <message>
      <source>Time limit [min]</source>
      <translation>Zeitgrenze [min]</translation>
    </message>
    <message>
      <source>Of the published method: CPU time that fitting Gaussians over the whole plot may take; a short one means fewer steps and smaller photos, and the report says how far it came.</source>
      <translation>Zum veröffentlichten Verfahren: Rechenzeit, die das Anpassen der Gauß-Elemente auf der ganzen Probefläche brauchen darf; eine kurze bedeutet weniger Schritte und kleinere Fotos, und der Bericht sagt, wie weit es kam.</translation>
    </message>
    <message>
      <source>Device</source>
      <translation>Gerät</translation>
    </message>
    <message>
      <source>Of the published method: where the Gaussians are fitted; cuda = an NVIDIA GPU, through the packages warp-lang and torch (its CUDA build); the time limit then counts by the clock.</source>
      <translation>Zum veröffentlichten Verfahren: wo die Gauß-Elemente angepasst werden; cuda = eine NVIDIA-GPU, über die Pakete warp-lang und torch (dessen CUDA-Fassung); die Zeitgrenze zählt dann nach der Uhr.</translation>
    </message>
    <message>
      <source>Dense</source>
      <translation>Verdichten</translation>
    </message>
    <message>
      <source>Of the published method: points to start the Gaussians from, OpenMVS's scene_dense.ply made from the workspace's sfm folder, or LAS/LAZ in the project CRS; without it our own stereo makes them.</source>
      <translation>Zum veröffentlichten Verfahren: Punkte, mit denen die Gauß-Elemente beginnen, OpenMVS' scene_dense.ply aus dem Ordner sfm des Arbeitsordners, oder LAS/LAZ im KBS des Projekts; ohne sie macht sie unser eigenes Stereoverfahren.</translation>
    </message>
    <message>
      <source>Breast height [m]</source>
      <translation>Brusthöhe [m]</translation>
    </message>
    <message>
      <source>Breast height above ground.</source>
      <translation>Brusthöhe über dem Boden.</translation>
    </message>
    <message>
      <source>Max DBH [cm]</source>
      <translation>Größter BHD [cm]</translation>
    </message>
    <message>
      <source>Thickest stem that is looked for; thicker ones are refused as too large.</source>
      <translation>Dickster Stamm, nach dem gesucht wird; dickere werden als too_large abgelehnt.</translation>
    </message>
    <message>
      <source>Evidence sheets (a picture a tree)</source>
      <translation>Belegblätter (ein Bild je Baum)</translation>
    </message>
    <message>
      <source>Evidence sheets, one small picture a tree: of all trees, of those to check and not measured, or none; auto = as the preset: those to check with fast, all otherwise.</source>
      <translation>Belegblätter, ein kleines Bild je Baum: von allen Bäumen, von denen, die zu prüfen oder nicht gemessen sind, oder keine; auto = wie die Voreinstellung: mit fast die zu prüfenden, sonst alle.</translation>
    </message>
    <message>
      <source>Heights</source>
      <translation>Höhen</translation>
    </message>
    <message>
      <source>Tree heights and a canopy height model (chm.tif) from the photos; auto = as the preset: not with fast.</source>
      <translation>Baumhöhen und ein Kronenhöhenmodell (chm.tif) aus den Fotos; auto = wie die Voreinstellung: nicht mit fast.</translation>
    </message>
    <message>
      <source>Orthophoto of the ground below the crowns</source>
      <translation>Orthofoto des Bodens unter den Kronen</translation>
    </message>
    <message>
      <source>Write the orthophoto of the ground below the crowns (ortho.tif): each place from the photos that see it; a few seconds a plot.</source>
      <translation>Schreibt das Orthofoto des Bodens unter den Kronen (ortho.tif): jede Stelle aus den Fotos, die sie sehen; wenige Sekunden je Probekreis.</translation>
    </message>
    <message>
      <source>Stem network</source>
      <translation>Stammnetz</translation>
    </message>
    <message>
      <source>A small network, trained on simulated photos, is asked which pixels show stems and ivy: auto = where the photos show the ground behind the stems; off = never.</source>
      <translation>Ein kleines, mit simulierten Fotos trainiertes Netz wird gefragt, welche Pixel Stämme und Efeu zeigen: auto = wo die Fotos den Boden hinter den Stämmen zeigen; off = nie.</translation>
    </message>
    <message>
      <source>tree layer (file)</source>
      <translation>Baumlayer (Datei)</translation>
    </message>
    <message>
      <source>HTML report (file)</source>
      <translation>HTML-Bericht (Datei)</translation>
    </message>
    <message>
      <source>folder of the results</source>
      <translation>Ordner der Ergebnisse</translation>
    </message>
    <message>
      <source>run.json: parameters, versions, seconds, peak memory (file)</source>
      <translation>run.json: Parameter, Versionen, Sekunden, größter Speicherbedarf (Datei)</translation>
    </message>
    <message>
      <source>stems found</source>
      <translation>gefundene Stämme</translation>
    </message>
    <message>
      <source>stems with a DBH</source>
      <translation>Stämme mit BHD</translation>
    </message>
    <message>
      <source>stems without one, each with a reason</source>
      <translation>Stämme ohne BHD, jeder mit einem Grund</translation>
    </message>
    <message>
      <source>mean DBH of the measured stems, cm</source>
      <translation>mittlerer BHD der gemessenen Stämme, cm</translation>
    </message>
    <message>
      <source>photos that can be used (dry run)</source>
      <translation>brauchbare Fotos (Probelauf)</translation>
    </message>
    <message>
      <source>photos with a fixed position, % (dry run)</source>
      <translation>Fotos mit fixierter Position, % (Probelauf)</translation>
    </message>
    <message>
      <source>ground that neighbouring photos share, % (dry run)</source>
      <translation>gemeinsamer Boden benachbarter Fotos, % (Probelauf)</translation>
    </message>
    <message>
      <source>tiles that are searched for stems (dry run)</source>
      <translation>Kacheln, in denen nach Stämmen gesucht wird (Probelauf)</translation>
    </message>
    <message>
      <source>estimated time, s (dry run)</source>
      <translation>geschätzte Zeit, s (Probelauf)</translation>
    </message>
    <message>
      <source>estimated memory, GB (dry run)</source>
      <translation>geschätzter Speicher, GB (Probelauf)</translation>
    </message>
    <message>
      <source>estimated disk, GB (dry run)</source>
      <translation>geschätzter Plattenplatz, GB (Probelauf)</translation>
    </message>
    <message>
      <source>what came out, in one sentence</source>
      <translation>was herauskam, in einem Satz</translation>
    </message>
    <message>
      <source>Measure DBH from a point cloud</source>
      <translation>BHD aus einer Punktwolke messen</translation>
    </message>
    <message>
      <source>From a LiDAR cloud (drone or terrestrial) or surface points to tree points with DBH.</source>
      <translation>Von einer LiDAR-Wolke (Drohne oder terrestrisch) oder Oberflächenpunkten zu Baumpunkten mit BHD.</translation>
    </message>
    <message>
      <source>Finds the ground (or takes your DTM), finds the stems in the band from 0.5 to 5 m, measures each at breast height and writes the tree layer: DBH, standard error and 90 % interval in cm, lean, height where the cloud reaches the crowns, and for every stem that cannot be measured the reason. Needs about 100 points on the lower 3 m of a stem (drone LiDAR above 1,000 points/m2, or a terrestrial scan). The CRS comes from the file; give --crs where it has none ('local' for a scan without a place on the map). Errors and limits were calibrated on rendered and simulated plots, mostly pines; no photo of a tree that somebody taped has been measured yet. Tape some trees: they say how right the diameters are.</source>
      <translation>Findet den Boden (oder nimmt Ihr Geländemodell), findet die Stämme im Band von 0,5 bis 5 m, misst jeden in Brusthöhe und schreibt den Baumlayer: BHD, Standardfehler und 90-%-Intervall in cm, Neigung, Höhe, wo die Wolke bis in die Kronen reicht, und für jeden nicht messbaren Stamm den Grund. Nötig sind etwa 100 Punkte auf den untersten 3 m eines Stamms (Drohnen-LiDAR mit mehr als 1000 Punkten/m2 oder ein terrestrischer Scan). Das KBS kommt aus der Datei; geben Sie --crs an, wo sie keines hat ('local' für einen Scan ohne Ort auf der Karte). Fehler und Grenzen wurden an gerenderten und simulierten Probeflächen bestimmt, meist mit Kiefern; noch wurde kein Foto eines Baums gemessen, den jemand mit dem Maßband gemessen hat. Messen Sie einige Bäume mit dem Maßband: sie sagen, wie richtig die Durchmesser sind.</translation>
    </message>
    <message>
      <source>Point cloud</source>
      <translation>Punktwolke</translation>
    </message>
    <message>
      <source>point cloud: LAS, LAZ, COPC, E57, or text with x y z per line</source>
      <translation>Punktwolke: LAS, LAZ, COPC, E57 oder Text mit x y z je Zeile</translation>
    </message>
    <message>
      <source>CSV of plots: plot_id, easting, northing, radius_m (or lon, lat); only stems in them are measured, without it those of the whole cloud</source>
      <translation>CSV der Probeflächen: plot_id, easting, northing, radius_m (oder lon, lat); nur Stämme darin werden gemessen, ohne sie die der ganzen Wolke</translation>
    </message>
    <message>
      <source>terrain raster; without it the ground is found in the cloud</source>
      <translation>Geländeraster; ohne es wird der Boden in der Wolke gesucht</translation>
    </message>
    <message>
      <source>CRS of a cloud that holds none: EPSG:CODE, or 'local' for metres without a place on the map</source>
      <translation>KBS einer Wolke, die keines enthält: EPSG:CODE oder 'local' für Meter ohne Ort auf der Karte</translation>
    </message>
    <message>
      <source>Only check the cloud, its CRS, density and DTM, memory and disk, and estimate the time; writes nothing</source>
      <translation>Nur Wolke, KBS, Dichte und Geländemodell, Speicher und Platte prüfen und die Zeit schätzen; schreibt nichts</translation>
    </message>
    <message>
      <source>tree layer</source>
      <translation>Baumlayer</translation>
    </message>
    <message>
      <source>Report</source>
      <translation>Bericht</translation>
    </message>
    <message>
      <source>also write a report: map, each DBH, what the cloud did not show, cost</source>
      <translation>auch einen Bericht schreiben: Karte, jeder BHD, was die Wolke nicht zeigte, Aufwand</translation>
    </message>
    <message>
      <source>Z is</source>
      <translation>Z ist</translation>
    </message>
    <message>
      <source>what z is: elevation, or height above ground (a normalised cloud); auto = read from the points</source>
      <translation>was z ist: Höhe über Null oder Höhe über dem Boden (eine normalisierte Wolke); auto = aus den Punkten gelesen</translation>
    </message>
    <message>
      <source>Reliability of points</source>
      <translation>Zuverlässigkeit der Punkte</translation>
    </message>
    <message>
      <source>reliability of the points: none, LiDAR intensity, or opacity of surface points</source>
      <translation>Verlässlichkeit der Punkte: keine, LiDAR-Intensität oder Deckkraft von Oberflächenpunkten</translation>
    </message>
    <message>
      <source>cross-section model</source>
      <translation>Modell des Querschnitts</translation>
    </message>
    <message>
      <source>Method</source>
      <translation>Verfahren</translation>
    </message>
    <message>
      <source>default = our estimator; paper = the published constants</source>
      <translation>default = unser Schätzer; paper = die veröffentlichten Konstanten</translation>
    </message>
    <message>
      <source>breast height</source>
      <translation>Brusthöhe</translation>
    </message>
    <message>
      <source>Min DBH [cm]</source>
      <translation>Kleinster BHD [cm]</translation>
    </message>
    <message>
      <source>thinner stems are refused as too small</source>
      <translation>dünnere Stämme werden als zu klein verworfen</translation>
    </message>
    <message>
      <source>thicker stems are refused as too large</source>
      <translation>dickere Stämme werden als zu groß verworfen</translation>
    </message>
    <message>
      <source>Source</source>
      <translation>Quelle</translation>
    </message>
    <message>
      <source>what made the points</source>
      <translation>woher die Punkte stammen</translation>
    </message>
    <message>
      <source>Evidence sheets, one small picture a tree: of all trees, of those to check and not measured, or none; auto = those to check and not measured.</source>
      <translation>Belegblätter, ein kleines Bild je Baum: von allen Bäumen, von denen, die zu prüfen oder nicht gemessen sind, oder keine; auto = die zu prüfenden und nicht gemessenen.</translation>
    </message>
    <message>
      <source>the page to open</source>
      <translation>die zu öffnende Seite</translation>
    </message>
    <message>
      <source>stems in the layer</source>
      <translation>Stämme im Layer</translation>
    </message>
    <message>
      <source>without remark</source>
      <translation>ohne Anmerkung</translation>
    </message>
    <message>
      <source>to check</source>
      <translation>zu prüfen</translation>
    </message>
    <message>
      <source>refused</source>
      <translation>verworfen</translation>
    </message>
    <message>
      <source>mean DBH, cm</source>
      <translation>mittlerer BHD, cm</translation>
    </message>
    <message>
      <source>points (dry run)</source>
      <translation>Punkte (Probelauf)</translation>
    </message>
    <message>
      <source>points a square metre (dry run)</source>
      <translation>Punkte je Quadratmeter (Probelauf)</translation>
    </message>
    <message>
      <source>verdict (dry run)</source>
      <translation>Urteil (Probelauf)</translation>
    </message>
    <message>
      <source>Measure many plots</source>
      <translation>Viele Probeflächen messen</translation>
    </message>
    <message>
      <source>Many plots from one table, on this machine or several: one trees layer, one report.</source>
      <translation>Viele Probeflächen aus einer Tabelle, auf diesem Rechner oder mehreren: ein Baumlayer, ein Bericht.</translation>
    </message>
    <message>
      <source>One row of the table is one plot, from photos or from a point cloud. All rows are checked before anything starts. Plots run side by side, as many as memory and cores carry, each in a folder of its own; a plot that fails is tried again at most twice and then reported, the others go on. A second start runs only what is missing or whose inputs or settings have changed. Writes one trees layer with plot ids, campaign.html and plots.csv (trees, refusals and reasons, seconds, memory, accuracy where field trees are given). Where plots failed it ends with an error (exit code 5) although layer and report are written. With --predict it only says how long it will take.</source>
      <translation>Eine Zeile der Tabelle ist eine Probefläche, aus Fotos oder einer Punktwolke. Alle Zeilen werden geprüft, bevor etwas beginnt. Die Flächen laufen nebeneinander, so viele Speicher und Kerne tragen, jede in einem eigenen Ordner; eine gescheiterte wird höchstens zweimal wiederholt und dann gemeldet, die anderen laufen weiter. Ein zweiter Start führt nur aus, was fehlt oder wessen Eingaben oder Einstellungen sich geändert haben. Schreibt einen Baumlayer mit Flächenkennungen, campaign.html und plots.csv (Bäume, Ablehnungen und Gründe, Sekunden, Speicher, Genauigkeit, wo Feldbäume vorliegen). Wo Flächen gescheitert sind, endet es mit einem Fehler (Exit-Code 5), obwohl Layer und Bericht geschrieben sind. Mit --predict sagt es nur, wie lange es dauern wird.</translation>
    </message>
    <message>
      <source>Manifest</source>
      <translation>Tabelle der Probeflächen</translation>
    </message>
    <message>
      <source>CSV with one row a plot: plot_id, photos (folder) or cloud (file), and where wanted geotags, dtm, crs, plots, field and any setting of the verb by its name; paths count from the table's folder</source>
      <translation>CSV mit einer Zeile je Probefläche: plot_id, photos (Ordner) oder cloud (Datei), und wo gewünscht geotags, dtm, crs, plots, field und jede Einstellung des Befehls unter ihrem Namen; Pfade zählen vom Ordner der Tabelle aus</translation>
    </message>
    <message>
      <source>CRS of rows that give none, and of the layer when rows have different ones</source>
      <translation>KBS der Zeilen, die keines angeben, und des Layers, wenn Zeilen verschiedene haben</translation>
    </message>
    <message>
      <source>Workers</source>
      <translation>Arbeitsprozesse</translation>
    </message>
    <message>
      <source>plots at once; 0 = as many as cores and memory carry</source>
      <translation>Flächen zugleich; 0 = so viele Kerne und Speicher tragen</translation>
    </message>
    <message>
      <source>Predict</source>
      <translation>Vorhersage</translation>
    </message>
    <message>
      <source>only check the table and say how long it will take and what it needs</source>
      <translation>nur die Tabelle prüfen und sagen, wie lange es dauert und was es braucht</translation>
    </message>
    <message>
      <source>folder for the campaign; a second start does what is missing</source>
      <translation>Ordner der Kampagne; ein zweiter Start erledigt, was fehlt</translation>
    </message>
    <message>
      <source>the one trees layer (.gpkg or .csv); without it trees.gpkg in the workspace</source>
      <translation>der eine Baumlayer (.gpkg oder .csv); sonst trees.gpkg im Arbeitsordner</translation>
    </message>
    <message>
      <source>Threads</source>
      <translation>Threads</translation>
    </message>
    <message>
      <source>processor threads a plot</source>
      <translation>Threads je Probefläche</translation>
    </message>
    <message>
      <source>Memory [GB]</source>
      <translation>Arbeitsspeicher [GB]</translation>
    </message>
    <message>
      <source>memory for all plots together; 0 = what is free, less a reserve</source>
      <translation>Speicher für alle Flächen zusammen; 0 = was frei ist, abzüglich einer Reserve</translation>
    </message>
    <message>
      <source>trees layer of all plots (file)</source>
      <translation>Baumlayer aller Probeflächen (Datei)</translation>
    </message>
    <message>
      <source>campaign report (file)</source>
      <translation>Bericht der Kampagne (Datei)</translation>
    </message>
    <message>
      <source>one row a plot (file)</source>
      <translation>eine Zeile je Probefläche (Datei)</translation>
    </message>
    <message>
      <source>plots in the table</source>
      <translation>Probeflächen der Tabelle</translation>
    </message>
    <message>
      <source>plots measured, now or before</source>
      <translation>gemessene Probeflächen, jetzt oder früher</translation>
    </message>
    <message>
      <source>plots run by this start</source>
      <translation>bei diesem Start gerechnete Probeflächen</translation>
    </message>
    <message>
      <source>plots kept from an earlier start</source>
      <translation>von einem früheren Start behaltene Probeflächen</translation>
    </message>
    <message>
      <source>plots given up, each with its reason in the report</source>
      <translation>aufgegebene Probeflächen, jede mit ihrem Grund im Bericht</translation>
    </message>
    <message>
      <source>seconds of this start</source>
      <translation>Sekunden dieses Starts</translation>
    </message>
    <message>
      <source>seconds that were forecast</source>
      <translation>vorhergesagte Sekunden</translation>
    </message>
    <message>
      <source>Geotag drone photos</source>
      <translation>Drohnenfotos verorten</translation>
    </message>
    <message>
      <source>5 Steps and research</source>
      <translation>5 Schritte und Forschung</translation>
    </message>
    <message>
      <source>MRK and RTKLIB .pos (or EXIF/XMP) to camera positions at the exposure, as a point layer.</source>
      <translation>MRK und RTKLIB-.pos (oder EXIF/XMP) zu Kamerapositionen bei der Auslösung, als Punktlayer.</translation>
    </message>
    <message>
      <source>Inputs: the photos, and a folder with the drone's Timestamp.MRK and the PPK solution (.pos), or a CSV by photo name. RINEX of rover and base is solved by RTKLIB (rnx2rtkp). The antenna's path is interpolated at each exposure and the lever arm applied once; heights stay ellipsoidal unless the project CRS has a height datum, which needs its geoid grid. Output: layer 'stations' (PointZ, project CRS) with quality (fix, float, single, exif, none), standard deviations (m), time, flight and gimbal angles (degrees). Photos that are blurred or show nothing are left out with a warning; geotags of other photos are refused.</source>
      <translation>Eingaben: die Fotos und ein Ordner mit Timestamp.MRK der Drohne und der PPK-Lösung (.pos), oder eine CSV nach Fotonamen. RINEX von Rover und Basis löst RTKLIB (rnx2rtkp). Die Bahn der Antenne wird für jede Auslösung interpoliert und der Hebelarm einmal angebracht; Höhen bleiben ellipsoidisch, außer das Projekt-KBS hat ein Höhendatum, das sein Geoidgitter braucht. Ausgabe: Layer 'stations' (PointZ, Projekt-KBS) mit Qualität (fix, float, single, exif, none), Standardabweichungen (m), Zeit, Flug und Winkeln der Kameraaufhängung (Grad). Unscharfe und leere Fotos werden mit einer Warnung ausgelassen; Geotags anderer Fotos werden abgelehnt.</translation>
    </message>
    <message>
      <source>Folder with the original drone photos (searched with its subfolders).</source>
      <translation>Ordner mit den originalen Drohnenfotos (samt Unterordnern durchsucht).</translation>
    </message>
    <message>
      <source>Folder or file with MRK and RTKLIB .pos or RINEX (PPK), or a CSV with name, lat, lon, h; without it EXIF/XMP positions are used.</source>
      <translation>Ordner oder Datei mit MRK und RTKLIB-.pos oder RINEX (PPK), oder eine CSV mit name, lat, lon, h; sonst gelten die Positionen aus EXIF/XMP.</translation>
    </message>
    <message>
      <source>Camera stations layer to write.</source>
      <translation>Zu schreibender Layer der Kamerastandorte.</translation>
    </message>
    <message>
      <source>Base</source>
      <translation>Basisstation</translation>
    </message>
    <message>
      <source>RINEX observations of the base station, when they do not lie with the geotags.</source>
      <translation>RINEX-Beobachtungen der Basisstation, wenn sie nicht bei den Geotags liegen.</translation>
    </message>
    <message>
      <source>Base position</source>
      <translation>Position der Basis</translation>
    </message>
    <message>
      <source>Base station 'latitude, longitude, height' (degrees, ellipsoidal m), for RINEX; default: its header's.</source>
      <translation>Basisstation 'Breite, Länge, Höhe' (Grad, ellipsoidische m), für RINEX; Vorgabe: aus deren Kopf.</translation>
    </message>
    <message>
      <source>Tagged photos</source>
      <translation>Verortete Fotos</translation>
    </message>
    <message>
      <source>New folder for copies of the photos with the corrected EXIF/XMP position; originals are never changed.</source>
      <translation>Neuer Ordner für Kopien der Fotos mit der verbesserten EXIF/XMP-Position; die Originale werden nie verändert.</translation>
    </message>
    <message>
      <source>Camera delay [ms]</source>
      <translation>Kameraverzögerung [ms]</translation>
    </message>
    <message>
      <source>Exposure minus mark time, for cameras triggered by cable.</source>
      <translation>Auslösung minus Markenzeit, für Kameras, die per Kabel ausgelöst werden.</translation>
    </message>
    <message>
      <source>camera stations layer (file)</source>
      <translation>Layer der Kamerastandorte (Datei)</translation>
    </message>
    <message>
      <source>photos with a fixed PPK/RTK position</source>
      <translation>Fotos mit fixierter PPK/RTK-Position</translation>
    </message>
    <message>
      <source>photos with a float position</source>
      <translation>Fotos mit Float-Position</translation>
    </message>
    <message>
      <source>photos with a navigation-grade position</source>
      <translation>Fotos mit einer Position von Navigationsgüte</translation>
    </message>
    <message>
      <source>photos without a position</source>
      <translation>Fotos ohne Position</translation>
    </message>
    <message>
      <source>flights</source>
      <translation>Flüge</translation>
    </message>
    <message>
      <source>tagged copies written</source>
      <translation>geschriebene verortete Kopien</translation>
    </message>
    <message>
      <source>Reconstruct cameras from photos</source>
      <translation>Kameras aus Fotos rekonstruieren</translation>
    </message>
    <message>
      <source>Georeferenced structure from motion: camera poses, sparse points, dense points of the stem band.</source>
      <translation>Georeferenzierte Structure from Motion: Kameralagen, lose Punkte, dichte Punkte des Stammbands.</translation>
    </message>
    <message>
      <source>Inputs: overlapping drone photos (80 % overlap, most of them oblique) and their PPK, RTK or EXIF positions, or three or more control points. All flights end in one frame, adjusted with the geotags as priors. Output in the workspace: geotags.gpkg, sfm/ (COLMAP model in a local frame, frame.json with the CRS and origin, report.json) and dense.laz (stem band of the plots, project CRS). A block that contradicts its geotags, the lens calibration in the metadata, or the flying height is refused.</source>
      <translation>Eingaben: überlappende Drohnenfotos (80 % Überlappung, die meisten schräg) und ihre PPK-, RTK- oder EXIF-Positionen oder drei oder mehr Passpunkte. Alle Flüge enden in einem Rahmen, mit den Geotags als Vorwissen ausgeglichen. Ausgabe im Arbeitsordner: geotags.gpkg, sfm/ (COLMAP-Modell in einem lokalen Rahmen, frame.json mit KBS und Ursprung, report.json) und dense.laz (Stammband der Probeflächen, Projekt-KBS). Ein Block, der seinen Geotags, der Linsenkalibrierung in den Metadaten oder der Flughöhe widerspricht, wird abgelehnt.</translation>
    </message>
    <message>
      <source>Make dense points of the stem band where plots are given.</source>
      <translation>Dichte Punkte des Stammbands erzeugen, wo Probeflächen angegeben sind.</translation>
    </message>
    <message>
      <source>COLMAP model (folder)</source>
      <translation>COLMAP-Modell (Ordner)</translation>
    </message>
    <message>
      <source>dense points of the stem band (file)</source>
      <translation>dichte Punkte des Stammbands (Datei)</translation>
    </message>
    <message>
      <source>photos registered</source>
      <translation>eingepasste Fotos</translation>
    </message>
    <message>
      <source>RMS reprojection error, px</source>
      <translation>mittlerer Rückprojektionsfehler (RMS), px</translation>
    </message>
    <message>
      <source>RMS distance of cameras to their geotags, E, N, U, m</source>
      <translation>mittlerer Abstand (RMS) der Kameras von ihren Geotags, O, N, H, m</translation>
    </message>
    <message>
      <source>RMS distance of the block to control points, E, N, U, m</source>
      <translation>Mittlerer quadratischer Abstand des Blocks von den Passpunkten, E, N, U, m</translation>
    </message>
    <message>
      <source>RMS distance of the block to check points, E, N, U, m</source>
      <translation>Mittlerer quadratischer Abstand des Blocks von den Kontrollpunkten, E, N, U, m</translation>
    </message>
    <message>
      <source>focal length, px</source>
      <translation>Brennweite, px</translation>
    </message>
    <message>
      <source>sparse points</source>
      <translation>lose Punkte</translation>
    </message>
    <message>
      <source>dense points</source>
      <translation>dichte Punkte</translation>
    </message>
    <message>
      <source>seconds of structure from motion</source>
      <translation>Sekunden der Structure from Motion</translation>
    </message>
    <message>
      <source>Terrain model from a point cloud</source>
      <translation>Geländemodell aus einer Punktwolke</translation>
    </message>
    <message>
      <source>Find the ground in a point cloud and write a terrain model (DTM).</source>
      <translation>Den Boden in einer Punktwolke finden und ein Geländemodell (DGM) schreiben.</translation>
    </message>
    <message>
      <source>A cloth is draped over the lowest points (cloth simulation filter), low plants are removed by a robust surface, and the ground is gridded by local planes. The GeoTIFF holds the ground height (band 1, metres, in the cloud's vertical datum) and the distance to the nearest ground point (band 2): read band 2 before you trust band 1. Cells farther than 10 m from ground are nodata.</source>
      <translation>Über die tiefsten Punkte wird ein Tuch gelegt (cloth simulation filter), niedrige Pflanzen werden durch eine robuste Fläche entfernt, und der Boden wird durch lokale Ebenen gerastert. Das GeoTIFF enthält die Bodenhöhe (Band 1, Meter, im Höhendatum der Wolke) und den Abstand zum nächsten Bodenpunkt (Band 2): lesen Sie Band 2, bevor Sie Band 1 trauen. Zellen, die mehr als 10 m vom Boden entfernt sind, sind ohne Wert.</translation>
    </message>
    <message>
      <source>terrain raster to write</source>
      <translation>zu schreibendes Geländeraster</translation>
    </message>
    <message>
      <source>CRS of a cloud that holds none: EPSG:CODE, or 'local'</source>
      <translation>KBS einer Wolke, die keines enthält: EPSG:CODE oder 'local'</translation>
    </message>
    <message>
      <source>Resolution [m]</source>
      <translation>Auflösung [m]</translation>
    </message>
    <message>
      <source>cell size</source>
      <translation>Zellgröße</translation>
    </message>
    <message>
      <source>Ground points</source>
      <translation>Bodenpunkte</translation>
    </message>
    <message>
      <source>also write the cloud, ground points as class 2 and heights above ground</source>
      <translation>auch die Wolke schreiben, Bodenpunkte als Klasse 2 und Höhen über dem Boden</translation>
    </message>
    <message>
      <source>Use classes</source>
      <translation>Klassen verwenden</translation>
    </message>
    <message>
      <source>trust the file's class 2 instead of finding the ground</source>
      <translation>der Klasse 2 der Datei trauen, statt den Boden zu suchen</translation>
    </message>
    <message>
      <source>Cloth [m]</source>
      <translation>Tuch [m]</translation>
    </message>
    <message>
      <source>cell size of the cloth</source>
      <translation>Maschenweite des Tuchs</translation>
    </message>
    <message>
      <source>Rigidness</source>
      <translation>Steifigkeit</translation>
    </message>
    <message>
      <source>1 steep, 2 hilly, 3 flat terrain</source>
      <translation>1 steiles, 2 hügeliges, 3 flaches Gelände</translation>
    </message>
    <message>
      <source>Threshold [m]</source>
      <translation>Schwelle [m]</translation>
    </message>
    <message>
      <source>largest distance of ground points from the cloth</source>
      <translation>größter Abstand der Bodenpunkte vom Tuch</translation>
    </message>
    <message>
      <source>terrain raster</source>
      <translation>Geländeraster</translation>
    </message>
    <message>
      <source>points used</source>
      <translation>verwendete Punkte</translation>
    </message>
    <message>
      <source>ground points among them</source>
      <translation>darunter Bodenpunkte</translation>
    </message>
    <message>
      <source>share of the extent with a ground height, %</source>
      <translation>Anteil der Ausdehnung mit Bodenhöhe, %</translation>
    </message>
    <message>
      <source>distance to the nearest ground point that 95 % of the cells stay under, m</source>
      <translation>Abstand zum nächsten Bodenpunkt, unter dem 95 % der Zellen bleiben, m</translation>
    </message>
    <message>
      <source>classified cloud</source>
      <translation>klassifizierte Wolke</translation>
    </message>
    <message>
      <source>Fit Gaussians to a plot</source>
      <translation>Gauß-Elemente an eine Probefläche anpassen</translation>
    </message>
    <message>
      <source>3D Gaussians over the whole plot, fitted to all photos as published.</source>
      <translation>3D-Gauß-Elemente über die ganze Probefläche, wie veröffentlicht an alle Fotos angepasst.</translation>
    </message>
    <message>
      <source>The first step of the published method, which photos-to-dbh --preset paper runs as a whole; sample-surface, segment-stems and measure-dbh are the others. Needs a workspace with a reconstruction (sfm/) and a terrain model (dtm.tif), and the package torch. Output: field.ply, Gaussians in the standard 3DGS format and local metres (its origin and CRS are in field.frame.json beside it). A short --time-limit means fewer steps and smaller photos; run.json says how far the fit came.</source>
      <translation>Der erste Schritt des veröffentlichten Verfahrens, das photos-to-dbh --preset paper als Ganzes ausführt; sample-surface, segment-stems und measure-dbh sind die weiteren. Braucht einen Arbeitsordner mit einer Rekonstruktion (sfm/) und einem Geländemodell (dtm.tif) sowie das Paket torch. Ergebnis: field.ply, Gauß-Elemente im üblichen 3DGS-Format in lokalen Metern (Ursprung und KBS stehen daneben in field.frame.json). Ein kurzes --time-limit bedeutet weniger Schritte und kleinere Fotos; run.json nennt, wie weit die Anpassung kam.</translation>
    </message>
    <message>
      <source>Workspace with sfm/ and dtm.tif; field.ply is written there.</source>
      <translation>Arbeitsordner mit sfm/ und dtm.tif; field.ply wird dort geschrieben.</translation>
    </message>
    <message>
      <source>Folder of the reconstructed photos; without it the one in run.json.</source>
      <translation>Ordner der rekonstruierten Fotos; ohne ihn der aus run.json.</translation>
    </message>
    <message>
      <source>Gaussian field (3DGS PLY, local metres)</source>
      <translation>Feld der Gauß-Elemente (3DGS-PLY, lokale Meter)</translation>
    </message>
    <message>
      <source>number of Gaussians</source>
      <translation>Anzahl der Gauß-Elemente</translation>
    </message>
    <message>
      <source>Sample surface points from Gaussians</source>
      <translation>Oberflächenpunkte aus Gauß-Elementen ziehen</translation>
    </message>
    <message>
      <source>Points drawn inside the Gaussians, each with its opacity reliability over the photos.</source>
      <translation>Punkte im Innern der Gauß-Elemente, jeder mit der Verlässlichkeit seiner Deckkraft über die Fotos.</translation>
    </message>
    <message>
      <source>Needs a workspace with field.ply (fit-gaussians), and the package torch. Draws up to M points inside each Gaussian, thinned by its opacity, and scores each by the opacity in front of it in every photo: the smallest over the photos that show Gaussians there is kept. Output: surface.laz in the project CRS with the extra dimensions opacity (0..1) and n_views (photos that show Gaussians there).</source>
      <translation>Braucht einen Arbeitsordner mit field.ply (fit-gaussians) sowie das Paket torch. Zieht bis zu M Punkte in jedem Gauß-Element, ausgedünnt nach ihrer Deckkraft, und bewertet jeden nach der Deckkraft vor ihm in jedem Foto: Die kleinste über die Fotos, die dort Gauß-Elemente zeigen, bleibt. Ergebnis: surface.laz im Projekt-KBS mit den zusätzlichen Dimensionen opacity (0..1) und n_views (Fotos, die dort Gauß-Elemente zeigen).</translation>
    </message>
    <message>
      <source>Workspace with sfm/ and field.ply; surface.laz is written there.</source>
      <translation>Arbeitsordner mit sfm/ und field.ply; surface.laz wird dort geschrieben.</translation>
    </message>
    <message>
      <source>surface points (LAZ with opacity, n_views)</source>
      <translation>Oberflächenpunkte (LAZ mit opacity, n_views)</translation>
    </message>
    <message>
      <source>number of points</source>
      <translation>Anzahl der Punkte</translation>
    </message>
    <message>
      <source>Find stems in a point cloud</source>
      <translation>Stämme in einer Punktwolke finden</translation>
    </message>
    <message>
      <source>Find stems in a point cloud and give each point the id of its tree.</source>
      <translation>Stämme in einer Punktwolke finden und jedem Punkt die Kennung seines Baums geben.</translation>
    </message>
    <message>
      <source>Looks in the band from 0.5 to 5 m above ground for rings (or discs, for surface points of splats) that repeat over the height, fits a leaning, tapering cone to each, keeps what is empty inside, clean outside and continuous, and follows the axis upwards. No trained weights. The output carries tree_id (0 = no stem), height_m, stem_class (0 other, 1 ground, 2 stem) and ground_se_m (how sure the ground under the tree is, 99 = not seen at all). --segmenter runs a program that you installed instead and checks that its labels belong to the points it was given. --field-stems gives known positions: near them weaker evidence is looked at, and the stems found carry the field's tree_id: pairs are one to one, as near as the positions are exact, 1 m at most. OUTPUT_field.csv answers for each: found, unsure (the stem near it may be another's), refused or missing, with the reason.</source>
      <translation>Sucht im Band von 0,5 bis 5 m über dem Boden nach Ringen (oder Scheiben, bei Oberflächenpunkten von Splats), die sich über die Höhe wiederholen, passt an jeden einen geneigten, sich verjüngenden Kegel an, behält, was innen leer, außen sauber und durchgehend ist, und folgt der Achse nach oben. Keine gelernten Gewichte. Die Ausgabe trägt tree_id (0 = kein Stamm), height_m, stem_class (0 anderes, 1 Boden, 2 Stamm) und ground_se_m (wie sicher der Boden unter dem Baum ist, 99 = gar nicht zu sehen). --segmenter führt stattdessen ein von Ihnen installiertes Programm aus und prüft, dass seine Kennungen zu den übergebenen Punkten gehören. --field-stems gibt bekannte Positionen: in ihrer Nähe genügen schwächere Anzeichen, und die gefundenen Stämme tragen die tree_id des Felds: Paare sind eins zu eins, so nah, wie die Positionen genau sind, höchstens 1 m. OUTPUT_field.csv antwortet für jeden: found, unsure (der Stamm daneben kann ein anderer sein), refused oder missing, mit dem Grund.</translation>
    </message>
    <message>
      <source>stem points with tree_id</source>
      <translation>Stammpunkte mit tree_id</translation>
    </message>
    <message>
      <source>Keep all</source>
      <translation>Alle behalten</translation>
    </message>
    <message>
      <source>write every point (tree_id 0 = no stem), not only stem points</source>
      <translation>jeden Punkt schreiben (tree_id 0 = kein Stamm), nicht nur Stammpunkte</translation>
    </message>
    <message>
      <source>positions of known stems (point layer, or CSV with x, y, tree_id): they are looked for harder, and name what is found</source>
      <translation>Positionen bekannter Stämme (Punktlayer oder CSV mit x, y, tree_id): nach ihnen wird genauer gesucht, und sie benennen das Gefundene</translation>
    </message>
    <message>
      <source>thickest stem</source>
      <translation>dickster Stamm</translation>
    </message>
    <message>
      <source>Segmenter</source>
      <translation>Segmentierer</translation>
    </message>
    <message>
      <source>who finds the trees: own needs nothing; forestformer3d, segmentanytree and treex are programs that you installed yourself (docs/analyst/measuring.md)</source>
      <translation>wer die Bäume findet: own braucht nichts; forestformer3d, segmentanytree und treex sind Programme, die Sie selbst installiert haben (docs/analyst/measuring.md)</translation>
    </message>
    <message>
      <source>Segmenter command</source>
      <translation>Befehl des Segmentierers</translation>
    </message>
    <message>
      <source>command line of that program, with {input} and {output} for its folders</source>
      <translation>Befehlszeile dieses Programms, mit {input} und {output} für seine Ordner</translation>
    </message>
    <message>
      <source>stem points with tree_id and height_m</source>
      <translation>Stammpunkte mit tree_id und height_m</translation>
    </message>
    <message>
      <source>points on stems</source>
      <translation>Punkte auf Stämmen</translation>
    </message>
    <message>
      <source>what was found of each field stem</source>
      <translation>was von jedem Feldstamm gefunden wurde</translation>
    </message>
    <message>
      <source>settings used: uls, tls, splat, or the segmenter</source>
      <translation>verwendete Einstellungen: uls, tls, splat oder der Segmentierer</translation>
    </message>
    <message>
      <source>Measure DBH of segmented stems</source>
      <translation>BHD segmentierter Stämme messen</translation>
    </message>
    <message>
      <source>Measure the DBH of stems whose points carry tree ids.</source>
      <translation>Den BHD der Stämme messen, deren Punkte Baumkennungen tragen.</translation>
    </message>
    <message>
      <source>Takes a cloud with a tree-id dimension (segment-stems, or another segmenter with --id-field) and writes one point a tree: DBH with its standard error and 90 % interval in cm, at breast height above the ground at the stem. --method paper gives the published estimator (solid circles, taper RANSAC; with --fit cylinder the published cylinder); the default fits a leaning, tapering stem to the bark points. A stem that cannot be measured stays in the layer with qc_flag=reject and the reason.</source>
      <translation>Nimmt eine Wolke mit einer Dimension der Baumkennungen (segment-stems, oder ein anderer Segmentierer mit --id-field) und schreibt einen Punkt je Baum: BHD mit Standardfehler und 90-%-Intervall in cm, in Brusthöhe über dem Boden am Stamm. --method paper gibt den veröffentlichten Schätzer (volle Kreise, Verjüngung mit RANSAC; mit --fit cylinder den veröffentlichten Zylinder); die Vorgabe passt einen geneigten, sich verjüngenden Stamm an die Rindenpunkte an. Ein nicht messbarer Stamm bleibt mit qc_flag=reject und dem Grund im Layer.</translation>
    </message>
    <message>
      <source>ID field</source>
      <translation>Feld der Kennung</translation>
    </message>
    <message>
      <source>dimension of the cloud that holds the tree ids</source>
      <translation>Dimension der Wolke, die die Baumkennungen enthält</translation>
    </message>
    <message>
      <source>Apply decisions from a table</source>
      <translation>Entscheidungen aus einer Tabelle übernehmen</translation>
    </message>
    <message>
      <source>Write a person's decisions on trees into the tree layer, beside the measured values.</source>
      <translation>Entscheidungen eines Menschen über Bäume in den Baumlayer schreiben, neben die gemessenen Werte.</translation>
    </message>
    <message>
      <source>Decisions: accept (tree and DBH count as measured), reject (no tree stands here), dbh (the taped diameter counts), merge (the same tree as same_as, which counts), stem (a stem stands here, its DBH is not known; without tree_id: at x, y of the layer's CRS), undo. They go into the columns rev_flag, rev_dbh_cm, rev_note, rev_by and rev_at; what was measured stays as it is. All decisions of a table are written or none. Pairing, evaluation and stand table use them and say how many; measuring again into the same layer keeps them. In QGIS the panel Review trees does the same by mouse.</source>
      <translation>Entscheidungen: accept (Baum und BHD gelten wie gemessen), reject (hier steht kein Baum), dbh (der mit dem Band gemessene Durchmesser gilt), merge (derselbe Baum wie same_as, der gilt), stem (hier steht ein Stamm, sein BHD ist nicht bekannt; ohne tree_id: bei x, y im KBS des Layers), undo. Sie kommen in die Spalten rev_flag, rev_dbh_cm, rev_note, rev_by und rev_at; was gemessen wurde, bleibt, wie es ist. Es werden alle Entscheidungen einer Tabelle geschrieben oder keine. Paarung, Bewertung und Bestandestabelle verwenden sie und sagen, wie viele; ein neuer Messlauf in denselben Layer behält sie. In QGIS tut das Bedienfeld Bäume prüfen dasselbe mit der Maus.</translation>
    </message>
    <message>
      <source>tree layer that the decisions are written into, in columns of their own</source>
      <translation>Baumlayer, in den die Entscheidungen geschrieben werden, in eigene Spalten</translation>
    </message>
    <message>
      <source>Decisions</source>
      <translation>Entscheidungen</translation>
    </message>
    <message>
      <source>CSV with tree_id, decision (accept, reject, dbh, merge, stem or undo) and, where needed, dbh_cm, same_as, x, y, note, by, at</source>
      <translation>CSV mit tree_id, decision (accept, reject, dbh, merge, stem oder undo) und, wo nötig, dbh_cm, same_as, x, y, note, by, at</translation>
    </message>
    <message>
      <source>DBH unit</source>
      <translation>Einheit des BHD</translation>
    </message>
    <message>
      <source>unit of the DBH column (auto: from a name like dbh_cm)</source>
      <translation>Einheit der BHD-Spalte (auto: nach einem Namen wie dbh_cm)</translation>
    </message>
    <message>
      <source>decisions written</source>
      <translation>geschriebene Entscheidungen</translation>
    </message>
    <message>
      <source>stems added</source>
      <translation>hinzugefügte Stämme</translation>
    </message>
    <message>
      <source>trees that a person decided on, in all</source>
      <translation>Bäume, über die ein Mensch entschieden hat, insgesamt</translation>
    </message>
    <message>
      <source>trees to check, or without a DBH, that nobody decided on yet</source>
      <translation>Bäume zum Prüfen oder ohne BHD, über die noch niemand entschieden hat</translation>
    </message>
    <message>
      <source>Pair field and measured trees</source>
      <translation>Feld- und gemessene Bäume paaren</translation>
    </message>
    <message>
      <source>Pair field trees with measured trees by position, as an editable layer.</source>
      <translation>Paart Feldbäume mit gemessenen Bäumen nach der Lage, als bearbeitbarer Layer.</translation>
    </message>
    <message>
      <source>Turns bearing and distance into coordinates (true, grid or magnetic north; level or slope distance; to the pith or the face), moves and turns each plot as a whole onto the measured trees, and pairs one to one. DBH is never used to pair, so the pairs can judge it. Where two placings fit about equally well, as in planted rows, the plot is left to you: the layer 'suggested' shows the best guess; set the plot's status to ok, or draw two pairs in the layer 'pairs', and run again. In the layer 'pairs', set pair_status to ok, moved (after dragging a line's end to another tree) or rejected: what you locked is kept when you run again onto the same file. Unpaired trees of both sides stay in the layers 'field_trees' and 'measured_trees'. Units: metres, centimetres, degrees.</source>
      <translation>Macht aus Richtung und Entfernung Koordinaten (geographisch, Gitter- oder magnetisch Nord; waagerechte oder schräge Entfernung; bis zur Mitte oder zur Stammfläche), verschiebt und dreht jede Probefläche als Ganzes auf die gemessenen Bäume und paart eins zu eins. Der BHD dient nie zum Paaren, so können die Paare ihn beurteilen. Wo zwei Lagen etwa gleich gut passen, wie in Pflanzreihen, bleibt die Fläche Ihnen überlassen: der Layer 'suggested' zeigt die beste Vermutung; setzen Sie den Status der Fläche auf ok oder zeichnen Sie zwei Paare im Layer 'pairs' und starten Sie erneut. Im Layer 'pairs' setzen Sie pair_status auf ok, moved (nachdem das Ende einer Linie auf einen anderen Baum gezogen wurde) oder rejected: was Sie festgelegt haben, bleibt, wenn Sie erneut auf dieselbe Datei starten. Ungepaarte Bäume beider Seiten bleiben in den Layern 'field_trees' und 'measured_trees'. Einheiten: Meter, Zentimeter, Grad.</translation>
    </message>
    <message>
      <source>measured trees: a tree layer, or CSV with tree_id, x, y, dbh_cm</source>
      <translation>gemessene Bäume: ein Baumlayer oder eine CSV mit tree_id, x, y, dbh_cm</translation>
    </message>
    <message>
      <source>Field trees (table)</source>
      <translation>Feldbäume (Tabelle)</translation>
    </message>
    <message>
      <source>field tally: plot_id, tree_id, azimuth_deg, distance_m (or easting, northing), dbh_cm</source>
      <translation>Feldaufnahme: plot_id, tree_id, azimuth_deg, distance_m (oder easting, northing), dbh_cm</translation>
    </message>
    <message>
      <source>plot centres: plot_id, easting, northing, epsg (or lon, lat), radius_m</source>
      <translation>Flächenmittelpunkte: plot_id, easting, northing, epsg (oder lon, lat), radius_m</translation>
    </message>
    <message>
      <source>North of the bearings</source>
      <translation>Nordbezug der Azimute</translation>
    </message>
    <message>
      <source>north that the bearings refer to (magnetic needs the date of the field work, or the declination)</source>
      <translation>Nordrichtung der Peilungen (magnetisch braucht das Datum der Feldarbeit oder die Deklination)</translation>
    </message>
    <message>
      <source>pairs layer; pairs locked in an existing file are kept</source>
      <translation>Paar-Layer; festgelegte Paare einer vorhandenen Datei bleiben erhalten</translation>
    </message>
    <message>
      <source>Declination [degrees, east positive]</source>
      <translation>Deklination [Grad, Ost positiv]</translation>
    </message>
    <message>
      <source>magnetic declination at the plot on the day of the field work; default: from the World Magnetic Model by --field-date, or the date column of a field table</source>
      <translation>magnetische Deklination an der Probefläche am Tag der Feldarbeit; Vorgabe: aus dem World Magnetic Model nach --field-date oder der Datumsspalte einer Feldtabelle</translation>
    </message>
    <message>
      <source>Field date</source>
      <translation>Datum der Feldarbeit</translation>
    </message>
    <message>
      <source>day of the field work, year-month-day, for the declination</source>
      <translation>Tag der Feldarbeit, Jahr-Monat-Tag, für die Deklination</translation>
    </message>
    <message>
      <source>Distances were taken</source>
      <translation>Entfernungen gemessen</translation>
    </message>
    <message>
      <source>distance along the level or along the ground (then the table needs slope_deg or slope_pct)</source>
      <translation>Entfernung waagerecht oder am Hang entlang (dann braucht die Tabelle slope_deg oder slope_pct)</translation>
    </message>
    <message>
      <source>Distances reach to</source>
      <translation>Entfernungen reichen bis</translation>
    </message>
    <message>
      <source>distance to the middle of the stem, or to its near face (half the DBH is added)</source>
      <translation>Entfernung bis zur Mitte des Stamms oder bis zu seiner Vorderseite (der halbe BHD kommt dazu)</translation>
    </message>
    <message>
      <source>Distance unit</source>
      <translation>Einheit der Entfernung</translation>
    </message>
    <message>
      <source>unit of a distance column that does not say it (auto: from a name like distance_m)</source>
      <translation>Einheit einer Entfernungsspalte, die sie nicht nennt (auto: aus einem Namen wie distance_m)</translation>
    </message>
    <message>
      <source>Centre error [m]</source>
      <translation>Fehler des Mittelpunkts [m]</translation>
    </message>
    <message>
      <source>standard error of the plot centres (0.05 for RTK, 4 under dense canopy); the search reaches three times as far</source>
      <translation>Standardfehler der Flächenmittelpunkte (0.05 bei RTK, 4 unter dichtem Kronendach); gesucht wird dreimal so weit</translation>
    </message>
    <message>
      <source>Rotation [degrees]</source>
      <translation>Drehung [Grad]</translation>
    </message>
    <message>
      <source>the plot may be turned by up to this angle (compass, declination)</source>
      <translation>um diesen Winkel darf die Fläche höchstens gedreht sein (Kompass, Deklination)</translation>
    </message>
    <message>
      <source>Trees DBH unit</source>
      <translation>BHD-Einheit der gemessenen Bäume</translation>
    </message>
    <message>
      <source>unit of a DBH column in a CSV of measured trees that does not say it (auto: from a name like dbh_cm)</source>
      <translation>Einheit einer BHD-Spalte in einer CSV gemessener Bäume, die sie nicht nennt (auto: aus einem Namen wie dbh_cm)</translation>
    </message>
    <message>
      <source>CRS of measured trees in a CSV, or of a layer without one</source>
      <translation>KBS gemessener Bäume in einer CSV oder eines Layers ohne KBS</translation>
    </message>
    <message>
      <source>pairs layer</source>
      <translation>Paar-Layer</translation>
    </message>
    <message>
      <source>field trees</source>
      <translation>Feldbäume</translation>
    </message>
    <message>
      <source>pairs made or confirmed</source>
      <translation>gebildete oder bestätigte Paare</translation>
    </message>
    <message>
      <source>measured trees that a person decided on</source>
      <translation>gemessene Bäume, über die ein Mensch entschieden hat</translation>
    </message>
    <message>
      <source>suggestions left to a hand check</source>
      <translation>Vorschläge, die von Hand zu prüfen sind</translation>
    </message>
    <message>
      <source>plots</source>
      <translation>Probeflächen</translation>
    </message>
    <message>
      <source>plots left to a hand check</source>
      <translation>Probeflächen, die von Hand zu prüfen sind</translation>
    </message>
    <message>
      <source>plots that fit best at the largest turn searched</source>
      <translation>Flächen, die bei der größten gesuchten Drehung am besten passen</translation>
    </message>
    <message>
      <source>Evaluate DBH accuracy</source>
      <translation>Genauigkeit des BHD bewerten</translation>
    </message>
    <message>
      <source>Accuracy tables and charts of measured DBH against field DBH.</source>
      <translation>Tabellen und Diagramme: gemessener BHD gegen Feld-BHD.</translation>
    </message>
    <message>
      <source>From the pairs layer of match-plots (pair_status auto, ok and moved count; rejected never): number of trees, success rate (trees with a DBH of all field trees), RMSE, RRMSE (of the mean field DBH), MAE, mean error (measured minus field), share of trees inside the stated 90 % interval and false trees, per plot and pooled, with bootstrap intervals by plot. Writes metrics.json, per_plot.csv, trees.csv, table.tex, charts (SVG and PNG) and evaluation.html. Plots left to a hand check do not count and are named. With --plots: several plots in one table, with mean, standard deviation and range over plots. With its columns lidar and splats: cylinder, circle and weighted circle on both, p chosen on held-out stems, densities, trend over DBH, ablation, and (simulated plots) segmentation scores and true labels. With workspace_in: how many photos show breast height, and runtime. Units: centimetres and per cent; rates in metrics.json are 0 to 1.</source>
      <translation>Aus dem Paar-Layer von match-plots (pair_status auto, ok und moved zählen; rejected nie): Zahl der Bäume, Erfolgsquote (Bäume mit BHD von allen Feldbäumen), RMSE, RRMSE (vom mittleren Feld-BHD), MAE, mittlerer Fehler (gemessen minus Feld), Anteil der Bäume im angegebenen 90-%-Intervall und falsche Bäume, je Probefläche und gesamt, mit Bootstrap-Intervallen über die Flächen. Schreibt metrics.json, per_plot.csv, trees.csv, table.tex, Diagramme (SVG und PNG) und evaluation.html. Flächen, die von Hand zu prüfen sind, zählen nicht und werden genannt. Mit --plots: mehrere Flächen in einer Tabelle, mit Mittel, Standardabweichung und Spanne über die Flächen. Mit deren Spalten lidar und splats: Zylinder, Kreis und gewichteter Kreis auf beiden, p an zurückgehaltenen Stämmen gewählt, Dichten, Gang über den BHD, Weglassversuche und (simulierte Flächen) Güte der Segmentierung und wahre Kennungen. Mit workspace_in: wie viele Fotos die Brusthöhe zeigen, und Laufzeit. Einheiten: Zentimeter und Prozent; Quoten in metrics.json sind 0 bis 1.</translation>
    </message>
    <message>
      <source>CSV with a row a plot and the columns plot_id, trees and truth (or pairs), and where there are any lidar, splats (surface.laz or stems.laz), dtm, workspace_in (of photos-to-dbh); paths count from the CSV's folder</source>
      <translation>CSV mit einer Zeile je Fläche und den Spalten plot_id, trees und truth (oder pairs), und wo vorhanden lidar, splats (surface.laz oder stems.laz), dtm, workspace_in (von photos-to-dbh); Pfade zählen vom Ordner der CSV</translation>
    </message>
    <message>
      <source>pairs layer of match-plots, checked by you</source>
      <translation>Paar-Layer von match-plots, von Ihnen geprüft</translation>
    </message>
    <message>
      <source>instead of pairs: a tree layer of a simulated plot</source>
      <translation>statt der Paare: ein Baumlayer einer simulierten Probefläche</translation>
    </message>
    <message>
      <source>folder for metrics.json, tables, charts and evaluation.html</source>
      <translation>Ordner für metrics.json, Tabellen, Diagramme und evaluation.html</translation>
    </message>
    <message>
      <source>smallest DBH that the field crew tallied; thinner measured trees are not counted as false</source>
      <translation>kleinster BHD, den die Feldaufnahme erfasst hat; dünnere gemessene Bäume gelten nicht als falsch</translation>
    </message>
    <message>
      <source>Truth</source>
      <translation>Wahrheit</translation>
    </message>
    <message>
      <source>with --trees: the plot's truth/trees.csv</source>
      <translation>mit --trees: truth/trees.csv der Probefläche</translation>
    </message>
    <message>
      <source>Pairs of another method</source>
      <translation>Paare eines anderen Verfahrens</translation>
    </message>
    <message>
      <source>pairs layer of another method for the same field trees: both are also scored on the trees both measured</source>
      <translation>Paar-Layer eines anderen Verfahrens für dieselben Feldbäume: beide werden auch auf den von beiden gemessenen Bäumen bewertet</translation>
    </message>
    <message>
      <source>folder</source>
      <translation>Ordner</translation>
    </message>
    <message>
      <source>page with the paper's tables and figures</source>
      <translation>Seite mit den Tabellen und Abbildungen der Veröffentlichung</translation>
    </message>
    <message>
      <source>metrics.json</source>
      <translation>metrics.json</translation>
    </message>
    <message>
      <source>trees measured and compared</source>
      <translation>gemessene und verglichene Bäume</translation>
    </message>
    <message>
      <source>measured of field trees, 0 to 1</source>
      <translation>gemessene von den Feldbäumen, 0 bis 1</translation>
    </message>
    <message>
      <source>RMSE, cm</source>
      <translation>RMSE, cm</translation>
    </message>
    <message>
      <source>RMSE, per cent of the mean field DBH</source>
      <translation>RMSE, Prozent des mittleren Feld-BHD</translation>
    </message>
    <message>
      <source>mean absolute error, cm</source>
      <translation>mittlerer absoluter Fehler, cm</translation>
    </message>
    <message>
      <source>mean error, cm</source>
      <translation>mittlerer Fehler, cm</translation>
    </message>
    <message>
      <source>measured trees that are no field tree</source>
      <translation>gemessene Bäume, die kein Feldbaum sind</translation>
    </message>
    <message>
      <source>share inside the stated 90 % interval, 0 to 1</source>
      <translation>Anteil im angegebenen 90-%-Intervall, 0 bis 1</translation>
    </message>
    <message>
      <source>Choose trees to tape</source>
      <translation>Bäume zum Nachmessen wählen</translation>
    </message>
    <message>
      <source>Draws the trees to tape with known chances, with a map and form to print and waypoints for the phone.</source>
      <translation>Zieht die nachzumessenden Bäume mit bekannten Wahrscheinlichkeiten; mit Karte und Formular zum Drucken und Wegpunkten fürs Telefon.</translation>
    </message>
    <message>
      <source>Draws trees of a tree layer so that the tapes can correct its totals (tape-check, stand-table): stratified by flag and DBH class, simple random in each. Stems without a DBH can be drawn too; dead trees are not. Writes tapes.gpkg and tapes.csv to fill in (taped_cm, or girth_cm; state none, dead or not reached; a row without tree_id is a tree that the map lacks), tapes.gpx for the phone, and tape_form.pdf and tape_form.html to print: per plot a map, the trees in the order of a walk, and room for trees that the map lacks. The form shows the measured DBH rounded to 5 cm, so that nobody reads the tape towards it. A folder whose table is filled in already is not written over.</source>
      <translation>Zieht Bäume einer Baumebene so, dass das Bandmaß ihre Summen berichtigen kann (tape-check, stand-table): geschichtet nach Kennzeichen und BHD-Klasse, in jeder einfach zufällig. Auch Stämme ohne BHD können gezogen werden, tote Bäume nicht. Schreibt tapes.gpkg und tapes.csv zum Ausfüllen (taped_cm oder girth_cm; state none, dead oder not reached; eine Zeile ohne tree_id ist ein Baum, der auf der Karte fehlt), tapes.gpx fürs Telefon sowie tape_form.pdf und tape_form.html zum Drucken: je Fläche eine Karte, die Bäume in der Reihenfolge des Rundgangs und Platz für Bäume, die auf der Karte fehlen. Das Formular zeigt den gemessenen BHD auf 5 cm gerundet, damit niemand das Band darauf hin abliest. Ein Ordner mit ausgefüllter Tabelle wird nicht überschrieben.</translation>
    </message>
    <message>
      <source>measured trees: the tree layer</source>
      <translation>gemessene Bäume: der Baumlayer</translation>
    </message>
    <message>
      <source>plots, as for stand-table: only trees in them are drawn, and the form gives bearing and distance from the plot's centre; without: the trees that have a plot_id, or all</source>
      <translation>Flächen wie für stand-table: nur Bäume darin werden gezogen, und das Formular nennt Richtung und Entfernung vom Mittelpunkt; ohne: die Bäume mit plot_id, sonst alle</translation>
    </message>
    <message>
      <source>trees to tape</source>
      <translation>nachzumessende Bäume</translation>
    </message>
    <message>
      <source>folder for the tape table, the form and the phone's waypoints</source>
      <translation>Ordner für die Tabelle, das Formular und die Wegpunkte fürs Telefon</translation>
    </message>
    <message>
      <source>Seed</source>
      <translation>Startwert</translation>
    </message>
    <message>
      <source>another number draws other trees; the same draws the same again</source>
      <translation>eine andere Zahl zieht andere Bäume, dieselbe wieder dieselben</translation>
    </message>
    <message>
      <source>CRS of trees in a CSV, or of a layer without one</source>
      <translation>KBS der Bäume in einer CSV oder eines Layers ohne KBS</translation>
    </message>
    <message>
      <source>the drawn trees, to fill in</source>
      <translation>die gezogenen Bäume, zum Ausfüllen</translation>
    </message>
    <message>
      <source>the same as CSV</source>
      <translation>dasselbe als CSV</translation>
    </message>
    <message>
      <source>the form to print (PDF)</source>
      <translation>das Formular zum Drucken (PDF)</translation>
    </message>
    <message>
      <source>the form as a page</source>
      <translation>das Formular als Seite</translation>
    </message>
    <message>
      <source>waypoints</source>
      <translation>Wegpunkte</translation>
    </message>
    <message>
      <source>trees drawn</source>
      <translation>gezogene Bäume</translation>
    </message>
    <message>
      <source>trees they were drawn from</source>
      <translation>Bäume, aus denen gezogen wurde</translation>
    </message>
    <message>
      <source>Check diameters against tapes</source>
      <translation>Durchmesser mit dem Bandmaß prüfen</translation>
    </message>
    <message>
      <source>What taped trees say of the measured ones: bias, intervals, flags, outliers, corrected totals.</source>
      <translation>Was nachgemessene Bäume über die gemessenen sagen: Verzerrung, Intervalle, Kennzeichen, Ausreißer, berichtigte Summen.</translation>
    </message>
    <message>
      <source>Reads the filled-in table of tape-sample. Bias (measured minus taped) and RMSE of all trees of the layer, with intervals that follow from the draw; whether the layer's 90 % intervals hold; whether trees marked ok are better than those marked check; outliers by name (and whether two numbers were exchanged); number and basal area of the trees corrected by the difference estimator of double sampling, with standard errors and how many more tapes would halve them. Units that the values contradict (inches, girths) are refused. Writes tape_check.html, .pdf, .csv, .gpkg and .json. stand-table --taped takes the same table.</source>
      <translation>Liest die ausgefüllte Tabelle von tape-sample. Verzerrung (gemessen minus Bandmaß) und RMSE aller Bäume der Ebene, mit Intervallen, die aus der Ziehung folgen; ob die 90-%-Intervalle der Ebene halten; ob Bäume mit ok besser sind als solche mit check; Ausreißer mit Nummer (und ob zwei Nummern vertauscht wurden); Zahl und Grundfläche der Bäume, berichtigt mit dem Differenzschätzer der zweiphasigen Stichprobe, mit Standardfehlern und wie viele Bäume mehr sie halbieren würden. Einheiten, denen die Werte widersprechen (Zoll, Umfänge), werden abgelehnt. Schreibt tape_check.html, .pdf, .csv, .gpkg und .json. stand-table --taped nimmt dieselbe Tabelle.</translation>
    </message>
    <message>
      <source>the tree layer that the taped trees were drawn from</source>
      <translation>die Baumebene, aus der die Bäume gezogen wurden</translation>
    </message>
    <message>
      <source>Taped trees (table)</source>
      <translation>Bäume mit Maßband (Tabelle)</translation>
    </message>
    <message>
      <source>the tape table of tape-sample, filled in: tapes.gpkg or tapes.csv</source>
      <translation>die ausgefüllte Tabelle von tape-sample: tapes.gpkg oder tapes.csv</translation>
    </message>
    <message>
      <source>the plots that were given to tape-sample</source>
      <translation>die Flächen, die tape-sample bekam</translation>
    </message>
    <message>
      <source>folder for the page and the tables</source>
      <translation>Ordner für Seite und Tabellen</translation>
    </message>
    <message>
      <source>the same as PDF</source>
      <translation>dasselbe als PDF</translation>
    </message>
    <message>
      <source>the taped trees with their errors</source>
      <translation>die nachgemessenen Bäume mit ihren Fehlern</translation>
    </message>
    <message>
      <source>trees both measured and taped</source>
      <translation>Bäume mit Messung und Bandmaß</translation>
    </message>
    <message>
      <source>mean error, measured minus taped, cm</source>
      <translation>mittlerer Fehler, gemessen minus Bandmaß, cm</translation>
    </message>
    <message>
      <source>its interval from, cm</source>
      <translation>sein Intervall von, cm</translation>
    </message>
    <message>
      <source>its interval to, cm</source>
      <translation>sein Intervall bis, cm</translation>
    </message>
    <message>
      <source>trees with an interval</source>
      <translation>Bäume mit Intervall</translation>
    </message>
    <message>
      <source>of these, with the tape inside</source>
      <translation>davon mit dem Bandmaß darin</translation>
    </message>
    <message>
      <source>trees to look at again</source>
      <translation>Bäume, die man noch einmal ansehen sollte</translation>
    </message>
    <message>
      <source>Test on your own taped plot</source>
      <translation>An eigener nachgemessener Fläche prüfen</translation>
    </message>
    <message>
      <source>Seals measured diameters, has trees taped without knowing them, and judges them by the tapes.</source>
      <translation>Versiegelt gemessene Durchmesser, lässt Bäume ohne Kenntnis davon mit dem Band messen und beurteilt sie danach.</translation>
    </message>
    <message>
      <source>Two steps in one folder. First --trees and --limit-cm: seals the layer's rows, the run's settings (where its run.json lies beside the layer), version and limit by SHA-256 in trial.json, and writes the files for the field as tape-sample does, without any diameter: all trees, or --n drawn at random. second_taped_cm takes a second tape of some trees. Then --taped: what was changed since is named and refused. Otherwise result/evaluation.html says RMSE, bias with its 90 % interval, whether measured and taped diameters are equivalent within the limit (two one-sided tests), how many 90 % intervals hold the tape, and how well tapes repeat; the figures are those of evaluate. bundle.json has the numbers without places, names and dates: send it in if you like.</source>
      <translation>Zwei Schritte in einem Ordner. Zuerst --trees und --limit-cm: versiegelt die Zeilen des Layers, die Einstellungen des Laufs (wo dessen run.json neben dem Layer liegt), Version und Grenze mit SHA-256 in trial.json und schreibt die Dateien fürs Gelände wie tape-sample, aber ohne jeden Durchmesser: alle Bäume oder --n zufällig gezogene. second_taped_cm nimmt ein zweites Band an einigen Bäumen auf. Dann --taped: was seither geändert wurde, wird genannt und abgelehnt. Sonst sagt result/evaluation.html RMSE, mittleren Fehler mit 90-%-Intervall, ob gemessene und Band-Durchmesser innerhalb der Grenze gleichwertig sind (zwei einseitige Tests), wie viele 90-%-Intervalle das Band enthalten und wie gut sich Bänder wiederholen; die Zahlen sind die von evaluate. bundle.json hat die Zahlen ohne Orte, Namen und Daten: schicken Sie sie gern ein.</translation>
    </message>
    <message>
      <source>first step: the tree layer to test; the trees.gpkg of a workspace seals the run's settings too. Second step: only where the layer was moved since</source>
      <translation>erster Schritt: der zu prüfende Baumlayer; die trees.gpkg eines Arbeitsordners versiegelt auch die Einstellungen des Laufs. Zweiter Schritt: nur, wo der Layer seither verschoben wurde</translation>
    </message>
    <message>
      <source>Limit [cm]</source>
      <translation>Grenze [cm]</translation>
    </message>
    <message>
      <source>first step: the mean error, either way, that you would still accept</source>
      <translation>erster Schritt: der mittlere Fehler, nach oben wie nach unten, den Sie noch hinnehmen</translation>
    </message>
    <message>
      <source>trees to tape, drawn at random; without: all</source>
      <translation>mit dem Band zu messende Bäume, zufällig gezogen; ohne: alle</translation>
    </message>
    <message>
      <source>plots, as for tape-sample: only trees in them are drawn</source>
      <translation>Probeflächen wie bei tape-sample: nur Bäume darin werden gezogen</translation>
    </message>
    <message>
      <source>second step: the table of the first one, filled in: tapes.gpkg or tapes.csv</source>
      <translation>zweiter Schritt: die ausgefüllte Tabelle des ersten: tapes.gpkg oder tapes.csv</translation>
    </message>
    <message>
      <source>folder of the trial, the same for both steps</source>
      <translation>Ordner der Prüfung, derselbe für beide Schritte</translation>
    </message>
    <message>
      <source>the page to open: the form, then the result</source>
      <translation>die zu öffnende Seite: das Formular, dann das Ergebnis</translation>
    </message>
    <message>
      <source>first step: the drawn trees, to fill in</source>
      <translation>erster Schritt: die gezogenen Bäume zum Ausfüllen</translation>
    </message>
    <message>
      <source>second step: the numbers, without places and names</source>
      <translation>zweiter Schritt: die Zahlen, ohne Orte und Namen</translation>
    </message>
    <message>
      <source>SHA-256 of all that is sealed</source>
      <translation>SHA-256 von allem, was versiegelt ist</translation>
    </message>
    <message>
      <source>trees drawn, then trees both measured and taped</source>
      <translation>gezogene Bäume, dann Bäume, die gemessen und mit dem Band gemessen sind</translation>
    </message>
    <message>
      <source>equivalent, not equivalent or undecided</source>
      <translation>equivalent (gleichwertig), not equivalent (nicht gleichwertig) oder undecided (unentschieden)</translation>
    </message>
    <message>
      <source>Stand table and report</source>
      <translation>Bestandestabelle und Bericht</translation>
    </message>
    <message>
      <source>4 Report</source>
      <translation>4 Berichten</translation>
    </message>
    <message>
      <source>Stand and stock tables per hectare with their errors, and a report for the client.</source>
      <translation>Bestandes- und Vorratstabellen je Hektar mit ihren Fehlern und ein Bericht für den Auftraggeber.</translation>
    </message>
    <message>
      <source>Expands the trees of fixed-area plots (round, rectangular or any polygon) to the hectare: trees, basal area, quadratic mean diameter, Lorey's and dominant height, volume and biomass by species and DBH class, plot means with standard errors and t intervals. Basal area and volume are freed of what the DBHs' own errors add to them, and the amount is shown. Stems without a DBH are counted and either imputed or left out; both are reported. With --taped (tape-sample) trees, basal area, volume and biomass are corrected by taped trees, and the interval is that of the tapes and the plots. Plots over the stand's edge are flagged and weighted. Volume and biomass come from a table of equations with source and range (loblolly and other pines first); give your own with --equations. From one plot no error for the stand can be given, and none is. Writes report.html, report.pdf, stand_table.xlsx, CSV files, stand.gpkg, shapefiles and FVS_Data.db (US units, for the Forest Vegetation Simulator), all with the same numbers. Result figures are metric.</source>
      <translation>Rechnet die Bäume fester Probeflächen (rund, rechteckig oder beliebige Vielecke) auf den Hektar hoch: Stammzahl, Grundfläche, Durchmesser des Grundflächenmittelstamms, Lorey'sche und Oberhöhe, Volumen und Biomasse nach Baumart und BHD-Klasse, Flächenmittel mit Standardfehlern und t-Intervallen. Grundfläche und Volumen werden von dem befreit, was die Fehler der BHD selbst hinzufügen, und der Betrag wird gezeigt. Stämme ohne BHD werden gezählt und entweder ergänzt oder ausgelassen; beides wird berichtet. Mit --taped (tape-sample) werden Stammzahl, Grundfläche, Volumen und Biomasse durch nachgemessene Bäume berichtigt, und das Intervall ist das der Nachmessung und der Flächen. Flächen über den Bestandesrand hinaus werden gekennzeichnet und gewichtet. Volumen und Biomasse kommen aus einer Tabelle von Gleichungen mit Quelle und Gültigkeitsbereich (Weihrauchkiefer und andere Kiefern zuerst); geben Sie eigene mit --equations an. Aus einer einzigen Probefläche lässt sich kein Fehler für den Bestand angeben, und es wird keiner angegeben. Schreibt report.html, report.pdf, stand_table.xlsx, CSV-Dateien, stand.gpkg, Shapefiles und FVS_Data.db (US-Einheiten, für den Forest Vegetation Simulator), alle mit denselben Zahlen. Die Ergebniswerte sind metrisch.</translation>
    </message>
    <message>
      <source>plots: centre and radius_m (or width_m, length_m), or a polygon layer; without: the whole boundary is one census</source>
      <translation>Probeflächen: Mittelpunkt und radius_m (oder width_m, length_m) oder ein Polygonlayer; sonst gilt die ganze Umgrenzung als Vollaufnahme</translation>
    </message>
    <message>
      <source>Species</source>
      <translation>Baumart</translation>
    </message>
    <message>
      <source>species of trees that have none: PLANTS symbol, FIA number or name (PITA, 131, Pinus taeda)</source>
      <translation>Baumart der Bäume, die keine haben: PLANTS-Kürzel, FIA-Nummer oder Name (PITA, 131, Pinus taeda)</translation>
    </message>
    <message>
      <source>pairs layer of match-plots: species and status of the measured trees</source>
      <translation>Paar-Layer von match-plots: Baumart und Status der gemessenen Bäume</translation>
    </message>
    <message>
      <source>field tally: heights of the paired trees; without --trees it is the tree list itself</source>
      <translation>Feldaufnahme: Höhen der gepaarten Bäume; ohne --trees ist sie selbst die Baumliste</translation>
    </message>
    <message>
      <source>Stand boundary</source>
      <translation>Bestandesgrenze</translation>
    </message>
    <message>
      <source>the stand's outline: finds plots that reach over its edge</source>
      <translation>der Umriss des Bestands: findet Probeflächen, die über seinen Rand reichen</translation>
    </message>
    <message>
      <source>the tape table of tape-sample, filled in: corrects trees, basal area, volume and biomass</source>
      <translation>die ausgefüllte Tabelle von tape-sample: berichtigt Bäume, Grundfläche, Volumen und Biomasse</translation>
    </message>
    <message>
      <source>Units</source>
      <translation>Einheiten</translation>
    </message>
    <message>
      <source>units of the report</source>
      <translation>Einheiten des Berichts</translation>
    </message>
    <message>
      <source>smallest DBH that counts</source>
      <translation>kleinster BHD, der zählt</translation>
    </message>
    <message>
      <source>folder for the report and the tables</source>
      <translation>Ordner für Bericht und Tabellen</translation>
    </message>
    <message>
      <source>Class width [cm, or inches in US units]</source>
      <translation>Klassenbreite [cm, in US-Einheiten Zoll]</translation>
    </message>
    <message>
      <source>width of a DBH class (5 cm or 2 inches where not given)</source>
      <translation>Breite einer BHD-Klasse (5 cm oder 2 Zoll, wo nicht angegeben)</translation>
    </message>
    <message>
      <source>Origin</source>
      <translation>Entstehung</translation>
    </message>
    <message>
      <source>how the stand came about</source>
      <translation>wie der Bestand entstanden ist</translation>
    </message>
    <message>
      <source>Stems without a DBH</source>
      <translation>Stämme ohne BHD</translation>
    </message>
    <message>
      <source>stems seen but without a DBH: count each, by its chance of being a tree, as the mean of its plot's measured trees, or leave them out (both results are reported)</source>
      <translation>Stämme, die gesehen, aber nicht gemessen wurden: jeden nach der Wahrscheinlichkeit, dass er ein Baum ist, als Mittel der gemessenen Bäume seiner Fläche zählen oder auslassen (beide Ergebnisse werden angegeben)</translation>
    </message>
    <message>
      <source>heights of trees that have none: from a curve fitted to the measured ones, none at all, or from a published regional curve</source>
      <translation>Höhen der Bäume, die keine haben: aus einer an die gemessenen angepassten Kurve, gar keine, oder aus einer veröffentlichten regionalen Kurve</translation>
    </message>
    <message>
      <source>Equations</source>
      <translation>Gleichungen</translation>
    </message>
    <message>
      <source>your own equations, tried before the built-in ones</source>
      <translation>Ihre eigenen Gleichungen, vor den eingebauten versucht</translation>
    </message>
    <message>
      <source>Top [cm]</source>
      <translation>Zopf [cm]</translation>
    </message>
    <message>
      <source>top diameter of the stem volumes that measured stem curves give (sections of the tree layer)</source>
      <translation>Zopfdurchmesser der Stammvolumen, die gemessene Stammkurven ergeben (sections des Baumlayers)</translation>
    </message>
    <message>
      <source>Edge</source>
      <translation>Rand</translation>
    </message>
    <message>
      <source>trees and plots at the stand's edge: zone (a tree weighs by the part of the plot-sized zone around it that is inside), walkthrough (some trees count twice), area (only the plot's part inside) or none (only flagged)</source>
      <translation>Bäume und Probeflächen am Bestandesrand: zone (ein Baum wiegt nach dem Teil der flächengroßen Zone um ihn, der innen liegt), walkthrough (manche Bäume zählen doppelt), area (nur der innere Teil der Fläche) oder none (nur gekennzeichnet)</translation>
    </message>
    <message>
      <source>Plot size</source>
      <translation>Flächengröße</translation>
    </message>
    <message>
      <source>plot sizes are horizontal, or were laid out along the slope (then slope_pct or slope_deg is needed)</source>
      <translation>Flächengrößen sind waagerecht oder wurden am Hang entlang abgesteckt (dann wird slope_pct oder slope_deg gebraucht)</translation>
    </message>
    <message>
      <source>DBH standard error [cm]</source>
      <translation>Standardfehler des BHD [cm]</translation>
    </message>
    <message>
      <source>standard error of DBH for trees that have none</source>
      <translation>Standardfehler des BHD der Bäume, die keinen haben</translation>
    </message>
    <message>
      <source>Common standard error [cm]</source>
      <translation>Gemeinsamer Standardfehler [cm]</translation>
    </message>
    <message>
      <source>standard error of a bias that all DBHs share (not given: 0.2 for measured trees, 0 for a field tally)</source>
      <translation>Standardfehler einer Abweichung, die alle BHD teilen (nicht angegeben: 0.2 für gemessene Bäume, 0 für eine Feldaufnahme)</translation>
    </message>
    <message>
      <source>Confidence [%]</source>
      <translation>Vertrauen [%]</translation>
    </message>
    <message>
      <source>confidence of the intervals</source>
      <translation>Vertrauensniveau der Intervalle</translation>
    </message>
    <message>
      <source>breast height of the height curve, for a field tally (a tree layer says its own)</source>
      <translation>Brusthöhe der Höhenkurve, für eine Feldaufnahme (ein Baumlayer nennt seine eigene)</translation>
    </message>
    <message>
      <source>Stand ID</source>
      <translation>Bestandeskennung</translation>
    </message>
    <message>
      <source>name of the stand, in every file</source>
      <translation>Name des Bestands, in jeder Datei</translation>
    </message>
    <message>
      <source>plots and trees as map layers</source>
      <translation>Probeflächen und Bäume als Kartenlayer</translation>
    </message>
    <message>
      <source>trees measured in the plots</source>
      <translation>in den Probeflächen gemessene Bäume</translation>
    </message>
    <message>
      <source>stems seen without a DBH</source>
      <translation>gesehene Stämme ohne BHD</translation>
    </message>
    <message>
      <source>trees that a person decided on</source>
      <translation>Bäume, über die ein Mensch entschieden hat</translation>
    </message>
    <message>
      <source>trees per hectare</source>
      <translation>Bäume je Hektar</translation>
    </message>
    <message>
      <source>basal area, m²/ha</source>
      <translation>Grundfläche, m²/ha</translation>
    </message>
    <message>
      <source>its standard error, m²/ha</source>
      <translation>ihr Standardfehler, m²/ha</translation>
    </message>
    <message>
      <source>quadratic mean diameter, cm</source>
      <translation>Durchmesser des Grundflächenmittelstamms, cm</translation>
    </message>
    <message>
      <source>Lorey's mean height, m</source>
      <translation>Lorey'sche Mittelhöhe, m</translation>
    </message>
    <message>
      <source>dominant height, m</source>
      <translation>Oberhöhe, m</translation>
    </message>
    <message>
      <source>volume, m³/ha</source>
      <translation>Volumen, m³/ha</translation>
    </message>
    <message>
      <source>above-ground biomass, t/ha</source>
      <translation>oberirdische Biomasse, t/ha</translation>
    </message>
    <message>
      <source>Compare two dates</source>
      <translation>Zwei Zeitpunkte vergleichen</translation>
    </message>
    <message>
      <source>Growth, ingrowth and mortality between two tree layers of the same ground, per tree and per hectare.</source>
      <translation>Zuwachs, Einwuchs und Abgang zwischen zwei Baumebenen desselben Geländes, je Baum und je Hektar.</translation>
    </message>
    <message>
      <source>Pairs the trees of both dates by position, plot by plot, as match-plots pairs field plots (the maps may be shifted and turned against each other; a plot whose placing is not sure is left out and named). Per tree: growth of DBH with its interval. Per hectare (with plots): growth of survivors, ingrowth, mortality and net change of basal area and of the number of trees, with errors from the spread of the plots and from what all trees of a date share (bias of the camera, scale of the block), which does not average out. A new tree that is too thick to be new was missed at the first date; the share of such trees says how many of those that are not found again are dead. Reviewed trees count as reviewed. Writes change.gpkg, change.csv, change.html, change.pdf and change.json.</source>
      <translation>Ordnet die Bäume beider Zeitpunkte nach der Lage einander zu, Fläche für Fläche, wie match-plots es mit Feldflächen tut (die Karten können gegeneinander verschoben und gedreht sein; eine Fläche mit unsicherer Lage wird ausgelassen und genannt). Je Baum: BHD-Zuwachs mit Intervall. Je Hektar (mit Flächen): Zuwachs der Überlebenden, Einwuchs, Abgang und Nettoveränderung von Grundfläche und Stammzahl, mit Fehlern aus der Streuung der Flächen und aus dem, was alle Bäume eines Zeitpunkts teilen (Verzerrung der Kamera, Maßstab des Blocks) und was sich nicht herausmittelt. Ein neuer Baum, der zu dick ist, um neu zu sein, wurde am ersten Zeitpunkt übersehen; der Anteil solcher Bäume sagt, wie viele der nicht wiedergefundenen tot sind. Geprüfte Bäume zählen, wie sie geprüft wurden. Schreibt change.gpkg, change.csv, change.html, change.pdf und change.json.</translation>
    </message>
    <message>
      <source>Before</source>
      <translation>Vorher</translation>
    </message>
    <message>
      <source>tree layer of the first date</source>
      <translation>Baumebene des ersten Zeitpunkts</translation>
    </message>
    <message>
      <source>After</source>
      <translation>Nachher</translation>
    </message>
    <message>
      <source>tree layer of the second date</source>
      <translation>Baumebene des zweiten Zeitpunkts</translation>
    </message>
    <message>
      <source>Years</source>
      <translation>Jahre</translation>
    </message>
    <message>
      <source>years (seasons of growth) between the dates; needed where the layers do not say when they were flown</source>
      <translation>Jahre (Vegetationszeiten) zwischen den Zeitpunkten; nötig, wo die Layer nicht sagen, wann sie geflogen wurden</translation>
    </message>
    <message>
      <source>plots, as for stand-table; without: all trees together, and nothing per hectare</source>
      <translation>Flächen wie für stand-table; ohne: alle Bäume zusammen und nichts je Hektar</translation>
    </message>
    <message>
      <source>folder for the page, the layer and the tables</source>
      <translation>Ordner für Seite, Ebene und Tabellen</translation>
    </message>
    <message>
      <source>Max yearly growth [cm]</source>
      <translation>Größter Jahreszuwachs [cm]</translation>
    </message>
    <message>
      <source>what no tree grows more in a year: a new one that is thicker than this allows was missed at the first date</source>
      <translation>mehr wächst kein Baum im Jahr: ein neuer, der dicker ist, als dies erlaubt, wurde am ersten Zeitpunkt übersehen</translation>
    </message>
    <message>
      <source>standard error of a bias that all DBHs of one date share</source>
      <translation>Standardfehler einer Verzerrung, die alle BHD eines Zeitpunkts teilen</translation>
    </message>
    <message>
      <source>Block before [%]</source>
      <translation>Block vorher [%]</translation>
    </message>
    <message>
      <source>relative standard error of lengths in the first date's block (scale_sd in the workspace's run.json, times 100)</source>
      <translation>relativer Standardfehler der Längen im Block des ersten Zeitpunkts (scale_sd in run.json des Arbeitsordners, mal 100)</translation>
    </message>
    <message>
      <source>Block after [%]</source>
      <translation>Block nachher [%]</translation>
    </message>
    <message>
      <source>the same of the second date's block</source>
      <translation>dasselbe für den Block des zweiten Zeitpunkts</translation>
    </message>
    <message>
      <source>how far the two maps may be shifted against each other, standard error (0.05 with RTK or PPK, 3 without)</source>
      <translation>wie weit die beiden Karten gegeneinander verschoben sein können, Standardfehler (0,05 mit RTK oder PPK, 3 ohne)</translation>
    </message>
    <message>
      <source>every tree with what became of it</source>
      <translation>jeder Baum mit seinem Verbleib</translation>
    </message>
    <message>
      <source>trees measured at both dates</source>
      <translation>an beiden Zeitpunkten gemessene Bäume</translation>
    </message>
    <message>
      <source>trees that grew into the count</source>
      <translation>eingewachsene Bäume</translation>
    </message>
    <message>
      <source>trees not found again, or dead</source>
      <translation>nicht wiedergefundene oder tote Bäume</translation>
    </message>
    <message>
      <source>trees whose partner is not sure</source>
      <translation>Bäume ohne sicheren Partner</translation>
    </message>
    <message>
      <source>mean growth of DBH of the survivors, cm a year</source>
      <translation>mittlerer BHD-Zuwachs der Überlebenden, cm im Jahr</translation>
    </message>
    <message>
      <source>net change of basal area, m²/ha</source>
      <translation>Nettoveränderung der Grundfläche, m²/ha</translation>
    </message>
    <message>
      <source>Benchmark speed and accuracy</source>
      <translation>Tempo und Genauigkeit vergleichen</translation>
    </message>
    <message>
      <source>Chart seconds against DBH error for every preset and method; or test where they fail.</source>
      <translation>Sekunden gegen BHD-Fehler für jede Voreinstellung und jedes Verfahren; oder prüfen, wo sie versagen.</translation>
    </message>
    <message>
      <source>Runs each configuration (presets, number of photos, photo size, features, LiDAR methods) on simulated plots with known truth and charts seconds, memory, RMSE and success rate, with the Pareto front and a recommended configuration for each preset. With --suite stability: one trouble at a time (few photos, wind, lean, pose noise, clutter, ...) at rising severity: errors, refusals, interval coverage, and every accepted tree that is more than 2 cm or three stated errors off. With --suite cost: how seconds and memory grow. Writes SVG, PNG, CSV, JSON, Markdown and a page without outside files. Compare seconds only within one run on an idle machine.</source>
      <translation>Führt jede Konfiguration (Voreinstellungen, Zahl der Fotos, Fotogröße, Merkmale, LiDAR-Verfahren) auf simulierten Probeflächen mit bekannter Wahrheit aus und zeichnet Sekunden, Speicher, RMSE und Erfolgsquote, mit der Pareto-Front und einer empfohlenen Konfiguration je Voreinstellung. Mit --suite stability: eine Störung nach der anderen (wenige Fotos, Wind, Neigung, Lagerauschen, Gestrüpp, ...) in steigender Schwere: Fehler, Ablehnungen, Treffer der Intervalle und jeder angenommene Baum, der mehr als 2 cm oder drei angegebene Fehler daneben liegt. Mit --suite cost: wie Sekunden und Speicher wachsen. Schreibt SVG, PNG, CSV, JSON, Markdown und eine Seite ohne fremde Dateien. Sekunden nur innerhalb eines Laufs auf einem unbelasteten Rechner vergleichen.</translation>
    </message>
    <message>
      <source>simulated plot, or a folder of them, to measure on; without it plots are simulated</source>
      <translation>simulierte Probefläche oder ein Ordner davon, auf denen gemessen wird; sonst werden Flächen simuliert</translation>
    </message>
    <message>
      <source>folder for charts and tables; finished runs are kept there, so that a stopped benchmark resumes</source>
      <translation>Ordner für Diagramme und Tabellen; fertige Läufe bleiben dort, so dass ein abgebrochener Vergleich fortgesetzt wird</translation>
    </message>
    <message>
      <source>Suite</source>
      <translation>Reihe</translation>
    </message>
    <message>
      <source>chart: seconds against error; stability: one factor at a time from harmless to hopeless; cost: seconds and memory of each stage against photos, megapixels, stems and points, fitted</source>
      <translation>chart: Sekunden gegen Fehler; stability: eine Störung nach der anderen von harmlos bis aussichtslos; cost: Sekunden und Speicher jeder Stufe gegen Fotos, Megapixel, Stämme und Punkte, angepasst</translation>
    </message>
    <message>
      <source>Quick</source>
      <translation>Kurz</translation>
    </message>
    <message>
      <source>one small plot and a dozen configurations: about 10 minutes on two idle cores</source>
      <translation>eine kleine Probefläche und ein Dutzend Konfigurationen: etwa 10 Minuten auf zwei freien Kernen</translation>
    </message>
    <message>
      <source>the chart (SVG)</source>
      <translation>das Diagramm (SVG)</translation>
    </message>
    <message>
      <source>runs of the chart</source>
      <translation>Läufe des Diagramms</translation>
    </message>
    <message>
      <source>configuration for each preset</source>
      <translation>Konfiguration je Voreinstellung</translation>
    </message>
    <message>
      <source>what there was no time for</source>
      <translation>wofür keine Zeit blieb</translation>
    </message>
    <message>
      <source>cases of the stability suite</source>
      <translation>Fälle der Stabilitätsreihe</translation>
    </message>
    <message>
      <source>cases that it has</source>
      <translation>Fälle, die sie umfasst</translation>
    </message>
    <message>
      <source>trees accepted by the photo method</source>
      <translation>vom Fotoverfahren angenommene Bäume</translation>
    </message>
    <message>
      <source>of them wrong: 2 cm or three stated errors off</source>
      <translation>davon falsch: 2 cm oder drei angegebene Fehler daneben</translation>
    </message>
    <message>
      <source>of them inside the stated 90 % interval, 0 to 1</source>
      <translation>davon im angegebenen 90-%-Intervall, 0 bis 1</translation>
    </message>
    <message>
      <source>at most 2 % of the accepted trees are wrong: 2 cm or three stated errors off</source>
      <translation>höchstens 2 % der angenommenen Bäume sind falsch: 2 cm oder drei angegebene Fehler daneben</translation>
    </message>
    <message>
      <source>the paper's own case on this machine, minutes</source>
      <translation>der Fall der Veröffentlichung auf diesem Rechner, Minuten</translation>
    </message>
    <message>
      <source>seconds it took</source>
      <translation>benötigte Sekunden</translation>
    </message>
    <message>
      <source>Simulate a plot</source>
      <translation>Eine Probefläche simulieren</translation>
    </message>
    <message>
      <source>Make a synthetic forest plot: drone photos, PPK files, LiDAR, field table and truth.</source>
      <translation>Eine künstliche Probefläche erzeugen: Drohnenfotos, PPK-Dateien, LiDAR, Feldtabelle und Wahrheit.</translation>
    </message>
    <message>
      <source>Grows a pine stand on rough ground and photographs it by ray casting in two oblique flights, with occluding crowns, shrubs and cast shadows, lens distortion and sensor noise. Writes images/ (EXIF, GPS, DJI XMP), the MRK and .pos files, dtm.tif, plots.csv, field_trees.csv, lidar/ and truth/ (for scoring only). Coordinates are EPSG:6344, heights ellipsoidal metres, DBH centimetres. Use it to try the chain, to test, or to see what a flight plan would measure. Real photos are harder than the defaults: wind, rolling shutter, motion blur, a real lens and sensor, grid flights over several plots and odd stands are options of treedgs simulate-plot, which its own help lists.</source>
      <translation>Lässt einen Kiefernbestand auf unebenem Boden wachsen und fotografiert ihn durch Strahlverfolgung auf zwei Schrägflügen, mit verdeckenden Kronen, Sträuchern und Schlagschatten, Linsenverzeichnung und Sensorrauschen. Schreibt images/ (EXIF, GPS, DJI-XMP), die MRK- und .pos-Dateien, dtm.tif, plots.csv, field_trees.csv, lidar/ und truth/ (nur zum Bewerten). Koordinaten sind EPSG:6344, Höhen ellipsoidische Meter, BHD Zentimeter. Zum Ausprobieren der Kette, zum Testen oder um zu sehen, was ein Flugplan messen würde. Echte Fotos sind schwieriger als die Voreinstellungen: Wind, Rolling Shutter, Bewegungsunschärfe, ein echtes Objektiv und ein echter Sensor, Rasterflüge über mehrere Probeflächen und eigenwillige Bestände sind Optionen der Befehlszeile (treedgs simulate-plot, siehe dessen Hilfe).</translation>
    </message>
    <message>
      <source>folder for the plot; made if missing, replaced if it is a simulated plot</source>
      <translation>Ordner für die Probefläche; wird angelegt, oder ersetzt, wenn er eine simulierte Fläche ist</translation>
    </message>
    <message>
      <source>size of the job: micro (3-5 stems, for the stability suite), test (3-6 stems), demo (6-9 stems), plot (0.03 ha, 62 photos)</source>
      <translation>Umfang der Aufgabe: micro (3-5 Stämme, für die Stabilitätsreihe), test (3-6 Stämme), demo (6-9 Stämme), plot (0,03 ha, 62 Fotos)</translation>
    </message>
    <message>
      <source>Radius [m]</source>
      <translation>Radius [m]</translation>
    </message>
    <message>
      <source>radius of the plot</source>
      <translation>Radius der Probefläche</translation>
    </message>
    <message>
      <source>planting density</source>
      <translation>Pflanzdichte</translation>
    </message>
    <message>
      <source>mean diameter at breast height</source>
      <translation>mittlerer Brusthöhendurchmesser</translation>
    </message>
    <message>
      <source>number of photos, both flights together</source>
      <translation>Zahl der Fotos, beide Flüge zusammen</translation>
    </message>
    <message>
      <source>Ground sample distance [cm]</source>
      <translation>Bodenauflösung [cm]</translation>
    </message>
    <message>
      <source>ground sample distance straight down from 70 m; sets the focal length</source>
      <translation>Bodenauflösung senkrecht nach unten aus 70 m; legt die Brennweite fest</translation>
    </message>
    <message>
      <source>random seed; the same seed gives the same plot</source>
      <translation>Startwert; derselbe gibt dieselbe Probefläche</translation>
    </message>
    <message>
      <source>the plot's folder</source>
      <translation>der Ordner der Probefläche</translation>
    </message>
    <message>
      <source>plot name used in the files</source>
      <translation>in den Dateien verwendeter Name der Probefläche</translation>
    </message>
    <message>
      <source>photos rendered</source>
      <translation>gerechnete Fotos</translation>
    </message>
    <message>
      <source>stems inside the plot</source>
      <translation>Stämme in der Probefläche</translation>
    </message>
    <message>
      <source>points of the LiDAR cloud</source>
      <translation>Punkte der LiDAR-Wolke</translation>
    </message>
    <message>
      <source>photos that see a stem's breast height free (median over the stems)</source>
      <translation>Fotos, die die Brusthöhe eines Stamms frei sehen (Median über die Stämme)</translation>
    </message>
    <message>
      <source>Check the engine</source>
      <translation>Rechenkern prüfen</translation>
    </message>
    <message>
      <source>Say what is installed, which steps work and how to install the rest.</source>
      <translation>Sagt, was installiert ist, welche Schritte laufen und wie der Rest zu installieren ist.</translation>
    </message>
    <message>
      <source>Loads every library of the engine, lists versions, cores, memory and disk, and says for each command whether it can run. Ends with an error and one sentence when something is missing.</source>
      <translation>Lädt jede Bibliothek des Rechenkerns, listet Versionen, Kerne, Speicher und Platte auf und sagt für jeden Befehl, ob er laufen kann. Endet mit einem Fehler und einem Satz, wenn etwas fehlt.</translation>
    </message>
    <message>
      <source>Compile</source>
      <translation>Übersetzen</translation>
    </message>
    <message>
      <source>Compile now what jobs otherwise compile when they first need it, for this processor; what is compiled already is kept. Setting up the engine does it.</source>
      <translation>Übersetzt jetzt, was Aufträge sonst übersetzen, wenn sie es zum ersten Mal brauchen, für diesen Prozessor; was schon übersetzt ist, bleibt. Das Einrichten des Rechenkerns tut es.</translation>
    </message>
    <message>
      <source>Python version</source>
      <translation>Python-Version</translation>
    </message>
    <message>
      <source>processor cores</source>
      <translation>Prozessorkerne</translation>
    </message>
    <message>
      <source>memory, GB</source>
      <translation>Arbeitsspeicher, GB</translation>
    </message>
    <message>
      <source>free disk for temporary files, GB</source>
      <translation>freier Plattenplatz für temporäre Dateien, GB</translation>
    </message>
    <message>
      <source>libraries found</source>
      <translation>gefundene Bibliotheken</translation>
    </message>
    <message>
      <source>libraries with versions</source>
      <translation>Bibliotheken mit Versionen</translation>
    </message>
    <message>
      <source>functions compiled now</source>
      <translation>jetzt übersetzte Funktionen</translation>
    </message>
    <message>
      <source>in words</source>
      <translation>in Worten</translation>
    </message>
    <message>
      <source>too few photos see the stem at breast height</source>
      <translation>zu wenige Fotos sehen den Stamm in Brusthöhe</translation>
    </message>
    <message>
      <source>fly more oblique photos over this part of the plot</source>
      <translation>mehr Schrägfotos über diesem Teil der Probefläche aufnehmen</translation>
    </message>
    <message>
      <source>foliage or other stems hide the stem at breast height</source>
      <translation>Laub oder andere Stämme verdecken den Stamm in Brusthöhe</translation>
    </message>
    <message>
      <source>fly leaf-off or from other directions</source>
      <translation>laubfrei oder aus anderen Richtungen fliegen</translation>
    </message>
    <message>
      <source>two different stems explain the photos equally well</source>
      <translation>zwei verschiedene Stämme erklären die Fotos gleich gut</translation>
    </message>
    <message>
      <source>check the photos or measure by hand</source>
      <translation>Fotos ansehen oder von Hand messen</translation>
    </message>
    <message>
      <source>ivy or other growth covers the bark at breast height</source>
      <translation>Efeu oder anderer Bewuchs bedeckt die Rinde in Brusthöhe</translation>
    </message>
    <message>
      <source>measure under it by hand; what is seen is thicker than the stem</source>
      <translation>darunter von Hand messen; was zu sehen ist, ist dicker als der Stamm</translation>
    </message>
    <message>
      <source>the bark is seen twice: two dates in one cloud, or scans that do not fit together</source>
      <translation>die Rinde ist doppelt zu sehen: zwei Zeitpunkte in einer Wolke oder Scans, die nicht zusammenpassen</translation>
    </message>
    <message>
      <source>give the scans of one date, registered to each other</source>
      <translation>geben Sie die Scans eines Zeitpunkts, aufeinander registriert</translation>
    </message>
    <message>
      <source>photos show the ground, or no bark, where the stem should stand: other things may line up there</source>
      <translation>Fotos zeigen den Boden oder keine Rinde, wo der Stamm stehen müsste: dort liegt wohl anderes in einer Linie</translation>
    </message>
    <message>
      <source>look at its photos or on site; there may be no stem</source>
      <translation>in seinen Fotos oder vor Ort nachsehen; vielleicht steht dort kein Stamm</translation>
    </message>
    <message>
      <source>the points cover too little of the stem's circumference</source>
      <translation>die Punkte decken zu wenig vom Umfang des Stamms ab</translation>
    </message>
    <message>
      <source>scan or fly from more sides</source>
      <translation>von mehr Seiten scannen oder fliegen</translation>
    </message>
    <message>
      <source>too few stem points at the lower stem</source>
      <translation>zu wenige Stammpunkte am unteren Stamm</translation>
    </message>
    <message>
      <source>raise the point density</source>
      <translation>die Punktdichte erhöhen</translation>
    </message>
    <message>
      <source>too few slices of the stem gave a circle</source>
      <translation>zu wenige Scheiben des Stamms ergaben einen Kreis</translation>
    </message>
    <message>
      <source>the cross-section is not a circle (buttress, fork or several stems)</source>
      <translation>der Querschnitt ist kein Kreis (Wurzelanläufe, Zwiesel oder mehrere Stämme)</translation>
    </message>
    <message>
      <source>measure by hand</source>
      <translation>von Hand messen</translation>
    </message>
    <message>
      <source>diameters along the stem do not form a plausible taper</source>
      <translation>die Durchmesser am Stamm bilden keine glaubhafte Verjüngung</translation>
    </message>
    <message>
      <source>check the stem for branches or a fork</source>
      <translation>den Stamm auf Äste oder einen Zwiesel prüfen</translation>
    </message>
    <message>
      <source>the stem leans more than the method allows</source>
      <translation>der Stamm ist stärker geneigt, als das Verfahren zulässt</translation>
    </message>
    <message>
      <source>two stems may have been taken for one</source>
      <translation>zwei Stämme können für einen gehalten worden sein</translation>
    </message>
    <message>
      <source>check the segmentation</source>
      <translation>die Segmentierung prüfen</translation>
    </message>
    <message>
      <source>the stem is thinner than the photos or points can resolve</source>
      <translation>der Stamm ist dünner, als Fotos oder Punkte auflösen können</translation>
    </message>
    <message>
      <source>fly lower or scan closer</source>
      <translation>tiefer fliegen oder näher scannen</translation>
    </message>
    <message>
      <source>the fitted stem is thicker than the allowed maximum</source>
      <translation>der angepasste Stamm ist dicker als das erlaubte Höchstmaß</translation>
    </message>
    <message>
      <source>raise the maximum diameter if it is real</source>
      <translation>den größten Durchmesser erhöhen, wenn er echt ist</translation>
    </message>
    <message>
      <source>the tree is far shorter than the others of its diameter</source>
      <translation>der Baum ist viel niedriger als die anderen seines Durchmessers</translation>
    </message>
    <message>
      <source>check the diameter, and whether the top is broken</source>
      <translation>Durchmesser prüfen, und ob der Wipfel gebrochen ist</translation>
    </message>
    <message>
      <source>the estimated error is too large to be useful</source>
      <translation>der geschätzte Fehler ist zu groß, um nützlich zu sein</translation>
    </message>
    <message>
      <source>fly more photos or measure by hand</source>
      <translation>mehr Fotos aufnehmen oder von Hand messen</translation>
    </message>
    <message>
      <source>breast height is hidden: measured 2 to 5 m above the ground, carried down by the taper of the plot's stems</source>
      <translation>Brusthöhe ist verdeckt: 2 bis 5 m über dem Boden gemessen und mit der Abholzigkeit der Stämme der Probefläche herabgeführt</translation>
    </message>
    <message>
      <source>check, or measure by hand where the tenth of a centimetre counts</source>
      <translation>prüfen, oder von Hand messen, wo der Zehntelzentimeter zählt</translation>
    </message>
    <message>
      <source>two measuring methods disagree</source>
      <translation>zwei Messverfahren widersprechen sich</translation>
    </message>
    <message>
      <source>check this tree by hand</source>
      <translation>diesen Baum von Hand prüfen</translation>
    </message>
    <message>
      <source>the published method has no check and no error of its own</source>
      <translation>das veröffentlichte Verfahren hat keine eigene Prüfung und keinen eigenen Fehler</translation>
    </message>
    <message>
      <source>compare with the default method</source>
      <translation>mit dem Standardverfahren vergleichen</translation>
    </message>
    <message>
      <source>the height of the ground at the tree is unknown or unsure</source>
      <translation>die Höhe des Bodens am Baum ist unbekannt oder unsicher</translation>
    </message>
    <message>
      <source>give the cloud with its ground, or a DTM that fits it</source>
      <translation>die Punktwolke mit ihrem Boden angeben, oder ein Geländemodell, das zu ihr passt</translation>
    </message>
    <message>
      <source>the photos of this run hardly fit together: points of some are not found where they must be in others</source>
      <translation>die Fotos dieses Laufs passen kaum zusammen: Punkte der einen finden sich in anderen nicht dort, wo sie sein müssen</translation>
    </message>
    <message>
      <source>fly with more overlap or in less wind, or check by hand</source>
      <translation>mit mehr Überlappung oder bei weniger Wind fliegen, oder von Hand prüfen</translation>
    </message>
    <message>
      <source>the trees are taller than trees of their diameter are: heights may be in feet</source>
      <translation>die Bäume sind höher, als Bäume ihres Durchmessers sind: die Höhen können in Fuß sein</translation>
    </message>
    <message>
      <source>check the unit of the cloud's heights and measure again</source>
      <translation>die Einheit der Höhen in der Punktwolke prüfen und neu messen</translation>
    </message>
    <message>
      <source>a person says that a stem stands here, but none was found</source>
      <translation>ein Mensch sagt, dass hier ein Stamm steht, aber es wurde keiner gefunden</translation>
    </message>
    <message>
      <source>measure it at its place in the photos, or by tape</source>
      <translation>an seinem Ort in den Fotos messen oder mit dem Band</translation>
    </message>
    <message>
      <source>the tree stands at the edge of the data</source>
      <translation>der Baum steht am Rand der Daten</translation>
    </message>
    <message>
      <source>extend the survey beyond the plot</source>
      <translation>über die Probefläche hinaus aufnehmen</translation>
    </message>
    <message>
      <source>Number at the first date</source>
      <translation>Nummer am ersten Zeitpunkt</translation>
    </message>
    <message>
      <source>Number at the second date</source>
      <translation>Nummer am zweiten Zeitpunkt</translation>
    </message>
    <message>
      <source>Fate</source>
      <translation>Verbleib</translation>
    </message>
    <message>
      <source>DBH at the first date [cm]</source>
      <translation>BHD am ersten Zeitpunkt [cm]</translation>
    </message>
    <message>
      <source>DBH at the second date [cm]</source>
      <translation>BHD am zweiten Zeitpunkt [cm]</translation>
    </message>
    <message>
      <source>Growth [cm]</source>
      <translation>Zuwachs [cm]</translation>
    </message>
    <message>
      <source>Growth, standard error [cm]</source>
      <translation>Zuwachs, Standardfehler [cm]</translation>
    </message>
    <message>
      <source>Growth, lower end of the interval [cm]</source>
      <translation>Zuwachs, Intervall von [cm]</translation>
    </message>
    <message>
      <source>Growth, upper end of the interval [cm]</source>
      <translation>Zuwachs, Intervall bis [cm]</translation>
    </message>
    <message>
      <source>Growth [cm a year]</source>
      <translation>Zuwachs [cm im Jahr]</translation>
    </message>
    <message>
      <source>Growth of basal area [m²]</source>
      <translation>Zuwachs der Grundfläche [m²]</translation>
    </message>
    <message>
      <source>Distance after co-registration [m]</source>
      <translation>Abstand nach der Einpassung [m]</translation>
    </message>
    <message>
      <source>Easting [m]</source>
      <translation>Ostwert [m]</translation>
    </message>
    <message>
      <source>Northing [m]</source>
      <translation>Nordwert [m]</translation>
    </message>
    <message>
      <source>survivor</source>
      <translation>überlebend</translation>
    </message>
    <message>
      <source>ingrowth</source>
      <translation>Einwuchs</translation>
    </message>
    <message>
      <source>mortality</source>
      <translation>Abgang</translation>
    </message>
    <message>
      <source>missed before</source>
      <translation>zuvor übersehen</translation>
    </message>
    <message>
      <source>no growth known</source>
      <translation>Zuwachs unbekannt</translation>
    </message>
    <message>
      <source>unsure</source>
      <translation>unsicher</translation>
    </message>
    <message>
      <source>too small</source>
      <translation>zu klein</translation>
    </message>
    <message>
      <source>dead</source>
      <translation>tot</translation>
    </message>
    <message>
      <source>DBH [cm]</source>
      <translation>BHD [cm]</translation>
    </message>
    <message>
      <source>Quality</source>
      <translation>Qualität</translation>
    </message>
    <message>
      <source>Crown area [m²]</source>
      <translation>Kronenfläche [m²]</translation>
    </message>
    <message>
      <source>Field DBH [cm]</source>
      <translation>Feld-BHD [cm]</translation>
    </message>
    <message>
      <source>Status</source>
      <translation>Status</translation>
    </message>
    <message>
      <source>Easting, co-registered [m]</source>
      <translation>Ostwert, eingepasst [m]</translation>
    </message>
    <message>
      <source>Northing, co-registered [m]</source>
      <translation>Nordwert, eingepasst [m]</translation>
    </message>
    <message>
      <source>Easting as surveyed [m]</source>
      <translation>Ostwert wie aufgenommen [m]</translation>
    </message>
    <message>
      <source>Northing as surveyed [m]</source>
      <translation>Nordwert wie aufgenommen [m]</translation>
    </message>
    <message>
      <source>Paired</source>
      <translation>Gepaart</translation>
    </message>
    <message>
      <source>Measured tree</source>
      <translation>Gemessener Baum</translation>
    </message>
    <message>
      <source>paired</source>
      <translation>gepaart</translation>
    </message>
    <message>
      <source>not paired</source>
      <translation>nicht gepaart</translation>
    </message>
    <message>
      <source>plot needs a hand check</source>
      <translation>Probefläche von Hand zu prüfen</translation>
    </message>
    <message>
      <source>pair rejected</source>
      <translation>Paar abgelehnt</translation>
    </message>
    <message>
      <source>not searched there</source>
      <translation>dort nicht gesucht</translation>
    </message>
    <message>
      <source>Measured DBH [cm]</source>
      <translation>Gemessener BHD [cm]</translation>
    </message>
    <message>
      <source>DBH as measured [cm]</source>
      <translation>BHD wie gemessen [cm]</translation>
    </message>
    <message>
      <source>Decision</source>
      <translation>Entscheidung</translation>
    </message>
    <message>
      <source>In the plot's circle</source>
      <translation>Im Kreis der Probefläche</translation>
    </message>
    <message>
      <source>Measured - field DBH [cm]</source>
      <translation>Gemessener - Feld-BHD [cm]</translation>
    </message>
    <message>
      <source>DBH, lower end of 90 % interval [cm]</source>
      <translation>BHD, unteres Ende des 90-%-Intervalls [cm]</translation>
    </message>
    <message>
      <source>DBH, upper end of 90 % interval [cm]</source>
      <translation>BHD, oberes Ende des 90-%-Intervalls [cm]</translation>
    </message>
    <message>
      <source>Log-odds against the next best pairing</source>
      <translation>Log-Chance gegen die nächstbeste Paarung</translation>
    </message>
    <message>
      <source>Pair status</source>
      <translation>Status des Paars</translation>
    </message>
    <message>
      <source>Note</source>
      <translation>Bemerkung</translation>
    </message>
    <message>
      <source>below -4 cm</source>
      <translation>unter -4 cm</translation>
    </message>
    <message>
      <source>-4 to -2 cm</source>
      <translation>-4 bis -2 cm</translation>
    </message>
    <message>
      <source>within 2 cm</source>
      <translation>innerhalb 2 cm</translation>
    </message>
    <message>
      <source>2 to 4 cm</source>
      <translation>2 bis 4 cm</translation>
    </message>
    <message>
      <source>above 4 cm</source>
      <translation>über 4 cm</translation>
    </message>
    <message>
      <source>Your decision</source>
      <translation>Ihre Entscheidung</translation>
    </message>
    <message>
      <source>The two trees</source>
      <translation>Die beiden Bäume</translation>
    </message>
    <message>
      <source>automatic</source>
      <translation>automatisch</translation>
    </message>
    <message>
      <source>confirmed</source>
      <translation>bestätigt</translation>
    </message>
    <message>
      <source>moved by hand</source>
      <translation>von Hand verschoben</translation>
    </message>
    <message>
      <source>Ground sample distance in the middle [cm]</source>
      <translation>Bodenauflösung in der Mitte [cm]</translation>
    </message>
    <message>
      <source>Line</source>
      <translation>Linie</translation>
    </message>
    <message>
      <source>Yaw, grid north [°]</source>
      <translation>Gierwinkel, Gitternord [°]</translation>
    </message>
    <message>
      <source>Yaw, true north [°]</source>
      <translation>Gierwinkel, wahrer Norden [°]</translation>
    </message>
    <message>
      <source>Pitch [°]</source>
      <translation>Kippung [°]</translation>
    </message>
    <message>
      <source>Height, datum of the terrain model [m]</source>
      <translation>Höhe, Bezug des Geländemodells [m]</translation>
    </message>
    <message>
      <source>Height above take-off [m]</source>
      <translation>Höhe über Startpunkt [m]</translation>
    </message>
    <message>
      <source>Height above ground [m]</source>
      <translation>Höhe über dem Boden [m]</translation>
    </message>
    <message>
      <source>Speed to the next photo [m/s]</source>
      <translation>Geschwindigkeit zum nächsten Foto [m/s]</translation>
    </message>
    <message>
      <source>Stems it is expected to show clearly</source>
      <translation>Stämme, die es erwartungsgemäß frei zeigt</translation>
    </message>
    <message>
      <source>Photo width [px]</source>
      <translation>Breite des Fotos [px]</translation>
    </message>
    <message>
      <source>Photo height [px]</source>
      <translation>Höhe des Fotos [px]</translation>
    </message>
    <message>
      <source>Focal length [px]</source>
      <translation>Brennweite [px]</translation>
    </message>
    <message>
      <source>oblique</source>
      <translation>schräg</translation>
    </message>
    <message>
      <source>straight down</source>
      <translation>senkrecht nach unten</translation>
    </message>
    <message>
      <source>Stems expected</source>
      <translation>Erwartete Stämme</translation>
    </message>
    <message>
      <source>Clear views a stem expected</source>
      <translation>Erwartete freie Blicke je Stamm</translation>
    </message>
    <message>
      <source>Share of the stems with a DBH expected</source>
      <translation>Erwarteter Anteil der Stämme mit BHD</translation>
    </message>
    <message>
      <source>Standard error of DBH expected, median [cm]</source>
      <translation>Erwarteter Standardfehler des BHD, Median [cm]</translation>
    </message>
    <message>
      <source>Photos that show it</source>
      <translation>Fotos, die sie zeigen</translation>
    </message>
    <message>
      <source>below 60 %</source>
      <translation>unter 60 %</translation>
    </message>
    <message>
      <source>60 to 85 %</source>
      <translation>60 bis 85 %</translation>
    </message>
    <message>
      <source>85 % and more</source>
      <translation>85 % und mehr</translation>
    </message>
    <message>
      <source>Reason</source>
      <translation>Grund</translation>
    </message>
    <message>
      <source>Moved east [m]</source>
      <translation>Verschoben nach Ost [m]</translation>
    </message>
    <message>
      <source>Moved north [m]</source>
      <translation>Verschoben nach Nord [m]</translation>
    </message>
    <message>
      <source>Turned clockwise [°]</source>
      <translation>Im Uhrzeigersinn gedreht [°]</translation>
    </message>
    <message>
      <source>Score over the next best placing</source>
      <translation>Güte gegenüber der nächstbesten Lage</translation>
    </message>
    <message>
      <source>Log-likelihood over the next best placing</source>
      <translation>Log-Likelihood gegenüber der nächstbesten Lage</translation>
    </message>
    <message>
      <source>Residual of the pairs [m]</source>
      <translation>Restabweichung der Paare [m]</translation>
    </message>
    <message>
      <source>Share of trees with a partner within 1 m</source>
      <translation>Anteil der Bäume mit einem Partner innerhalb 1 m</translation>
    </message>
    <message>
      <source>Measured trees in the circle</source>
      <translation>Gemessene Bäume im Kreis</translation>
    </message>
    <message>
      <source>Suggestions</source>
      <translation>Vorschläge</translation>
    </message>
    <message>
      <source>Easting of the centre, co-registered [m]</source>
      <translation>Ostwert des Mittelpunkts, eingepasst [m]</translation>
    </message>
    <message>
      <source>Northing of the centre, co-registered [m]</source>
      <translation>Nordwert des Mittelpunkts, eingepasst [m]</translation>
    </message>
    <message>
      <source>placed</source>
      <translation>eingepasst</translation>
    </message>
    <message>
      <source>confirmed by hand</source>
      <translation>von Hand bestätigt</translation>
    </message>
    <message>
      <source>needs a hand check</source>
      <translation>von Hand zu prüfen</translation>
    </message>
    <message>
      <source>Easting of the middle [m]</source>
      <translation>Ostwert der Mitte [m]</translation>
    </message>
    <message>
      <source>Northing of the middle [m]</source>
      <translation>Nordwert der Mitte [m]</translation>
    </message>
    <message>
      <source>Area searched [m²]</source>
      <translation>Abgesuchte Fläche [m²]</translation>
    </message>
    <message>
      <source>Share of the plot searched</source>
      <translation>Abgesuchter Anteil der Fläche</translation>
    </message>
    <message>
      <source>Day of the photos or points</source>
      <translation>Tag der Fotos oder Punkte</translation>
    </message>
    <message>
      <source>Diameter [cm]</source>
      <translation>Durchmesser [cm]</translation>
    </message>
    <message>
      <source>Diameter standard error [cm]</source>
      <translation>Standardfehler des Durchmessers [cm]</translation>
    </message>
    <message>
      <source>Roughness, rms [cm]</source>
      <translation>Rauigkeit, rms [cm]</translation>
    </message>
    <message>
      <source>Points</source>
      <translation>Punkte</translation>
    </message>
    <message>
      <source>Circumference seen [°]</source>
      <translation>Gesehener Umfang [°]</translation>
    </message>
    <message>
      <source>0 to 2 m above ground</source>
      <translation>0 bis 2 m über dem Boden</translation>
    </message>
    <message>
      <source>2 to 5 m above ground</source>
      <translation>2 bis 5 m über dem Boden</translation>
    </message>
    <message>
      <source>5 to 10 m above ground</source>
      <translation>5 bis 10 m über dem Boden</translation>
    </message>
    <message>
      <source>10 to 15 m above ground</source>
      <translation>10 bis 15 m über dem Boden</translation>
    </message>
    <message>
      <source>15 to 60 m above ground</source>
      <translation>15 bis 60 m über dem Boden</translation>
    </message>
    <message>
      <source>Shape</source>
      <translation>Form</translation>
    </message>
    <message>
      <source>Edge of the stand</source>
      <translation>Bestandesrand</translation>
    </message>
    <message>
      <source>Area [ha]</source>
      <translation>Fläche [ha]</translation>
    </message>
    <message>
      <source>Trees per hectare that one tree stands for</source>
      <translation>Bäume je Hektar, für die ein Baum steht</translation>
    </message>
    <message>
      <source>Dead trees</source>
      <translation>Tote Bäume</translation>
    </message>
    <message>
      <source>Trees per hectare</source>
      <translation>Bäume je Hektar</translation>
    </message>
    <message>
      <source>Basal area [m²/ha]</source>
      <translation>Grundfläche [m²/ha]</translation>
    </message>
    <message>
      <source>Quadratic mean diameter [cm]</source>
      <translation>Durchmesser des Grundflächenmittelstamms [cm]</translation>
    </message>
    <message>
      <source>Lorey's mean height [m]</source>
      <translation>Lorey'sche Mittelhöhe [m]</translation>
    </message>
    <message>
      <source>Dominant height [m]</source>
      <translation>Oberhöhe [m]</translation>
    </message>
    <message>
      <source>Volume [m³/ha]</source>
      <translation>Volumen [m³/ha]</translation>
    </message>
    <message>
      <source>Biomass above ground [t/ha]</source>
      <translation>Oberirdische Biomasse [t/ha]</translation>
    </message>
    <message>
      <source>Counts as</source>
      <translation>Zählt als</translation>
    </message>
    <message>
      <source>Height [m]</source>
      <translation>Höhe [m]</translation>
    </message>
    <message>
      <source>Height from</source>
      <translation>Höhe aus</translation>
    </message>
    <message>
      <source>Weight</source>
      <translation>Gewicht</translation>
    </message>
    <message>
      <source>Trees per hectare it stands for</source>
      <translation>Bäume je Hektar, für die er steht</translation>
    </message>
    <message>
      <source>Basal area [m²]</source>
      <translation>Grundfläche [m²]</translation>
    </message>
    <message>
      <source>Volume [m³]</source>
      <translation>Volumen [m³]</translation>
    </message>
    <message>
      <source>Biomass above ground [kg]</source>
      <translation>Oberirdische Biomasse [kg]</translation>
    </message>
    <message>
      <source>Reasons</source>
      <translation>Gründe</translation>
    </message>
    <message>
      <source>File</source>
      <translation>Datei</translation>
    </message>
    <message>
      <source>Position quality</source>
      <translation>Güte der Position</translation>
    </message>
    <message>
      <source>Standard deviation east [m]</source>
      <translation>Standardabweichung Ost [m]</translation>
    </message>
    <message>
      <source>Standard deviation north [m]</source>
      <translation>Standardabweichung Nord [m]</translation>
    </message>
    <message>
      <source>Standard deviation up [m]</source>
      <translation>Standardabweichung Höhe [m]</translation>
    </message>
    <message>
      <source>Exposure (UTC)</source>
      <translation>Auslösung (UTC)</translation>
    </message>
    <message>
      <source>Exposure (UTC) [s since 1970]</source>
      <translation>Auslösung (UTC) [s seit 1970]</translation>
    </message>
    <message>
      <source>Flight</source>
      <translation>Flug</translation>
    </message>
    <message>
      <source>Yaw [°]</source>
      <translation>Kurs [°]</translation>
    </message>
    <message>
      <source>Roll [°]</source>
      <translation>Rollung [°]</translation>
    </message>
    <message>
      <source>Velocity east [m/s]</source>
      <translation>Geschwindigkeit Ost [m/s]</translation>
    </message>
    <message>
      <source>Velocity north [m/s]</source>
      <translation>Geschwindigkeit Nord [m/s]</translation>
    </message>
    <message>
      <source>Velocity up [m/s]</source>
      <translation>Vertikalgeschwindigkeit [m/s]</translation>
    </message>
    <message>
      <source>Source of the velocity</source>
      <translation>Herkunft der Geschwindigkeit</translation>
    </message>
    <message>
      <source>fixed (centimetres)</source>
      <translation>fixiert (Zentimeter)</translation>
    </message>
    <message>
      <source>float (decimetres)</source>
      <translation>Float (Dezimeter)</translation>
    </message>
    <message>
      <source>single (metres)</source>
      <translation>Einzelposition (Meter)</translation>
    </message>
    <message>
      <source>from the photo (metres)</source>
      <translation>aus dem Foto (Meter)</translation>
    </message>
    <message>
      <source>unknown</source>
      <translation>unbekannt</translation>
    </message>
    <message>
      <source>Taped DBH [cm]</source>
      <translation>BHD mit dem Band [cm]</translation>
    </message>
    <message>
      <source>Measured - taped DBH [cm]</source>
      <translation>BHD gemessen - Bandmaß [cm]</translation>
    </message>
    <message>
      <source>Tape inside the interval</source>
      <translation>Bandmaß im Intervall</translation>
    </message>
    <message>
      <source>State</source>
      <translation>Zustand</translation>
    </message>
    <message>
      <source>Look again</source>
      <translation>Noch einmal ansehen</translation>
    </message>
    <message>
      <source>Place in the walk</source>
      <translation>Platz im Rundgang</translation>
    </message>
    <message>
      <source>Second tape [cm]</source>
      <translation>Zweites Band [cm]</translation>
    </message>
    <message>
      <source>Drawn tree beside it</source>
      <translation>Gezogener Baum daneben</translation>
    </message>
    <message>
      <source>Measured DBH, about [cm]</source>
      <translation>Gemessener BHD, etwa [cm]</translation>
    </message>
    <message>
      <source>Bearing from the centre [°]</source>
      <translation>Richtung vom Mittelpunkt [°]</translation>
    </message>
    <message>
      <source>Distance from the centre [m]</source>
      <translation>Entfernung vom Mittelpunkt [m]</translation>
    </message>
    <message>
      <source>Longitude [°]</source>
      <translation>Länge [°]</translation>
    </message>
    <message>
      <source>Latitude [°]</source>
      <translation>Breite [°]</translation>
    </message>
    <message>
      <source>Stratum</source>
      <translation>Schicht</translation>
    </message>
    <message>
      <source>Chance of being drawn</source>
      <translation>Wahrscheinlichkeit der Ziehung</translation>
    </message>
    <message>
      <source>Trees that were drawn from</source>
      <translation>Bäume, aus denen gezogen wurde</translation>
    </message>
    <message>
      <source>Design</source>
      <translation>Verfahren</translation>
    </message>
    <message>
      <source>Mark of the list</source>
      <translation>Kennung der Liste</translation>
    </message>
    <message>
      <source>to tape</source>
      <translation>nachzumessen</translation>
    </message>
    <message>
      <source>no tree there</source>
      <translation>kein Baum da</translation>
    </message>
    <message>
      <source>not reached</source>
      <translation>nicht erreicht</translation>
    </message>
    <message>
      <source>Filled in by the crew</source>
      <translation>Vom Trupp ausgefüllt</translation>
    </message>
    <message>
      <source>Drawn tree</source>
      <translation>Gezogener Baum</translation>
    </message>
    <message>
      <source>none (no tree there)</source>
      <translation>none (kein Baum da)</translation>
    </message>
    <message>
      <source>Easting at breast height [m]</source>
      <translation>Ostwert in Brusthöhe [m]</translation>
    </message>
    <message>
      <source>Northing at breast height [m]</source>
      <translation>Nordwert in Brusthöhe [m]</translation>
    </message>
    <message>
      <source>Ground height [m]</source>
      <translation>Bodenhöhe [m]</translation>
    </message>
    <message>
      <source>Breast height used [m]</source>
      <translation>Verwendete Brusthöhe [m]</translation>
    </message>
    <message>
      <source>Tree height, standard error [m]</source>
      <translation>Baumhöhe, Standardfehler [m]</translation>
    </message>
    <message>
      <source>Why there is no height</source>
      <translation>Warum es keine Höhe gibt</translation>
    </message>
    <message>
      <source>Lean [°]</source>
      <translation>Neigung [°]</translation>
    </message>
    <message>
      <source>Stem circumference seen [°]</source>
      <translation>Gesehener Stammumfang [°]</translation>
    </message>
    <message>
      <source>Stem points</source>
      <translation>Stammpunkte</translation>
    </message>
    <message>
      <source>Photos that see the stem</source>
      <translation>Fotos, die den Stamm sehen</translation>
    </message>
    <message>
      <source>Slices fitted</source>
      <translation>Angepasste Scheiben</translation>
    </message>
    <message>
      <source>Mean opacity (0-1)</source>
      <translation>Mittlere Deckkraft (0-1)</translation>
    </message>
    <message>
      <source>Taper [cm/m]</source>
      <translation>Verjüngung [cm/m]</translation>
    </message>
    <message>
      <source>Run</source>
      <translation>Lauf</translation>
    </message>
    <message>
      <source>Live or dead</source>
      <translation>Lebend oder tot</translation>
    </message>
    <message>
      <source>Why</source>
      <translation>Warum</translation>
    </message>
    <message>
      <source>Decided by</source>
      <translation>Entschieden von</translation>
    </message>
    <message>
      <source>Decided at (UTC)</source>
      <translation>Entschieden am (UTC)</translation>
    </message>
    <message>
      <source>seen, no DBH</source>
      <translation>gesehen, kein BHD</translation>
    </message>
    <message>
      <source>by hand: accepted, taped</source>
      <translation>von Hand: angenommen, gemessen</translation>
    </message>
    <message>
      <source>by hand: no DBH</source>
      <translation>von Hand: kein BHD</translation>
    </message>
    <message>
      <source>by hand: no tree</source>
      <translation>von Hand: kein Baum</translation>
    </message>
    <message>
      <source>pale: outside the plots</source>
      <translation>blass: außerhalb der Probeflächen</translation>
    </message>
    <message>
      <source>Yours to write</source>
      <translation>Von Ihnen zu schreiben</translation>
    </message>
    <message>
      <source>Measured</source>
      <translation>Gemessen</translation>
    </message>
    <message>
      <source>not said</source>
      <translation>nicht angegeben</translation>
    </message>
    <message>
      <source>live</source>
      <translation>lebend</translation>
    </message>
    <message>
      <source>not decided</source>
      <translation>nicht entschieden</translation>
    </message>
  </context>
</TS>
